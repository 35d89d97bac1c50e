//! The columns of a data set: one line each in the tables below.

use crate::make::{Row, Touch};
use crate::spec::{Choice, ObjectSource, Spec};
use crate::store::{Kind, Store};
use serde::Serialize;
use spts::recon::metrics::{SUPPORT_THRESHOLD, support};

/// A column, as `spts dataset schema` shows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Type of a value.
    pub kind: Kind,
    /// Values of a row: a list of so many; none for a single value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<usize>,
    /// Unit; empty without one.
    pub unit: &'static str,
    /// What it is.
    pub description: &'static str,
}

impl Column {
    /// Type in words, such as `float32[100]`.
    #[must_use]
    pub fn type_name(&self) -> String {
        let name = match self.kind {
            Kind::Text => "text",
            Kind::Bool => "bool",
            Kind::I32 => "int32",
            Kind::I64 => "int64",
            Kind::F32 => "float32",
        };
        self.length
            .map_or_else(|| name.to_owned(), |length| format!("{name}[{length}]"))
    }
}

/// How long a list column is.
type Length = fn(&Spec) -> usize;

/// One value a row.
const ONE: Option<Length> = None;
/// One value a taxel.
const TAXELS: Option<Length> = Some(|spec| spec.skin().taxels());
/// One value a measurement.
const MEASUREMENTS: Option<Length> = Some(|spec| spec.config().record.measurements);
/// One value a measurement and taxel, row by row of Φ.
const PHI: Option<Length> = Some(|spec| spec.config().record.measurements * spec.skin().taxels());

/// Name, type, length, unit, description, which specs have it, and how a row fills it.
type RowColumn = (
    &'static str,
    Kind,
    Option<Length>,
    &'static str,
    &'static str,
    fn(&Spec) -> bool,
    fn(&Row<'_>, &mut Store),
);

const ALWAYS: fn(&Spec) -> bool = |_| true;

const ROW_COLUMNS: &[RowColumn] = &[
    (
        "index",
        Kind::I64,
        ONE,
        "",
        "number of the row, from 0",
        ALWAYS,
        |r, s| s.integer(r.index()),
    ),
    (
        "split",
        Kind::Text,
        ONE,
        "",
        "train, validation or test",
        ALWAYS,
        |r, s| s.text(r.split()),
    ),
    (
        "press",
        Kind::I64,
        ONE,
        "",
        "number of the press; all its windows are in one split",
        ALWAYS,
        |r, s| s.integer(r.press()),
    ),
    (
        "window",
        Kind::I32,
        ONE,
        "",
        "number of the window within its press, from 0",
        ALWAYS,
        |r, s| s.integer(r.window() as u64),
    ),
    (
        "objects",
        Kind::I32,
        ONE,
        "",
        "number of objects on the skin",
        ALWAYS,
        |r, s| s.integer(r.objects() as u64),
    ),
    (
        "skin_seed",
        Kind::I64,
        ONE,
        "",
        "specimen of the skin: its taxels and parts",
        ALWAYS,
        |r, s| s.integer(r.skin_seed()),
    ),
    ("session", Kind::I64, ONE, "", "session of the skin", ALWAYS, |r, s| {
        s.integer(r.session())
    }),
    (
        "faults",
        Kind::I32,
        ONE,
        "",
        "number of faulty cells",
        ALWAYS,
        |r, s| s.integer(r.faults() as u64),
    ),
    (
        "presses_before",
        Kind::I32,
        ONE,
        "",
        "presses of the same kind before this one in the session",
        ALWAYS,
        |r, s| s.integer(r.presses_before() as u64),
    ),
    (
        "time_s",
        Kind::F32,
        ONE,
        "s",
        "time from the touch to the first measurement",
        ALWAYS,
        |r, s| s.number(r.time_s()),
    ),
    (
        "over_edge",
        Kind::Bool,
        ONE,
        "",
        "whether a part of an object lies beside the sheet",
        ALWAYS,
        |r, s| {
            s.flag((0..r.objects()).any(|k| r.object(k).is_some_and(|(.., touch)| touch.over_edge)));
        },
    ),
    (
        "saturated",
        Kind::I32,
        ONE,
        "",
        "samples of y at an end of the converter or at a rail",
        ALWAYS,
        |r, s| s.integer(r.saturated()[0] as u64),
    ),
    (
        "saturated_raster",
        Kind::I32,
        ONE,
        "",
        "the same of the raster scan",
        |spec| spec.config().record.raster,
        |r, s| {
            s.integer(r.saturated()[1] as u64);
        },
    ),
    (
        "first_row",
        Kind::I64,
        ONE,
        "",
        "row of Φ of the first measurement, from the loading of the seeds",
        ALWAYS,
        |r, s| s.integer(r.first_row()),
    ),
    (
        "pressure_pa",
        Kind::F32,
        TAXELS,
        "Pa",
        "true mean pressure over every taxel's cell, row by row of the skin",
        ALWAYS,
        |r, s| {
            s.numbers(r.pressure().values());
        },
    ),
    (
        "conductance_s",
        Kind::F32,
        TAXELS,
        "S",
        "true conductance of every taxel",
        ALWAYS,
        |r, s| s.numbers(r.conductance().values()),
    ),
    (
        "support",
        Kind::Bool,
        TAXELS,
        "",
        "taxels above 23 % of the largest conductance",
        ALWAYS,
        |r, s| {
            s.mark(|out| support(r.conductance().values(), SUPPORT_THRESHOLD, out));
        },
    ),
    (
        "image_v",
        Kind::F32,
        TAXELS,
        "V",
        "image as the raster scan has it, noise included",
        |spec| spec.config().record.raster,
        |r, s| {
            s.numbers(r.image());
        },
    ),
    (
        "y_v",
        Kind::F32,
        MEASUREMENTS,
        "V",
        "the samples of the one wire",
        |spec| !spec.config().record.codes,
        |r, s| s.numbers(r.volts()),
    ),
    (
        "y_code",
        Kind::I32,
        MEASUREMENTS,
        "",
        "the samples of the one wire, as codes of the converter",
        |spec| spec.config().record.codes,
        |r, s| {
            s.integers(r.codes().map(i64::from));
        },
    ),
    (
        "phi",
        Kind::F32,
        PHI,
        "",
        "Φ of the samples: measurements × taxels, row by row",
        |spec| spec.config().record.phi,
        |r, s| s.numbers(&r.phi()),
    ),
];

/// Name, type, unit, description, which specs have it, and the value of an object.
type ObjectColumn = (
    &'static str,
    Kind,
    &'static str,
    &'static str,
    fn(&Spec) -> bool,
    fn(&Choice, u64, &Touch, &mut Store),
);

const OF_SHAPES: fn(&Spec) -> bool = |spec| spec.config().object.from == ObjectSource::Shapes;

/// Columns of every object; those of the second and third end in `_2` and `_3` and are null where there is none.
const OBJECT_COLUMNS: &[ObjectColumn] = &[
    (
        "object",
        Kind::Text,
        "",
        "name of the object, or family of the shape",
        ALWAYS,
        |c, _, _, s| s.text(&c.name),
    ),
    (
        "label",
        Kind::I32,
        "",
        "class: the object's label, or the place in the list of families or files",
        ALWAYS,
        |c, _, _, s| {
            s.signed(i64::from(c.label));
        },
    ),
    (
        "shape",
        Kind::I64,
        "",
        "number of the shape",
        ALWAYS,
        |_, number, _, s| s.integer(number),
    ),
    (
        "x_m",
        Kind::F32,
        "m",
        "place of its origin from the middle of the sheet, to large columns",
        ALWAYS,
        |_, _, t, s| s.number(t.position_m[0]),
    ),
    ("y_m", Kind::F32, "m", "the same to small rows", ALWAYS, |_, _, t, s| {
        s.number(t.position_m[1])
    }),
    (
        "height_m",
        Kind::F32,
        "m",
        "height of its origin over the skin's free surface",
        ALWAYS,
        |_, _, t, s| s.number(t.height_m),
    ),
    (
        "rotation_deg",
        Kind::F32,
        "°",
        "rotation about the skin's normal, counter-clockwise from above",
        ALWAYS,
        |_, _, t, s| s.number(t.rotation_deg),
    ),
    (
        "tilt_x_deg",
        Kind::F32,
        "°",
        "tilt about the skin's x axis at which it is held",
        ALWAYS,
        |_, _, t, s| s.number(t.tilt_deg[0]),
    ),
    (
        "tilt_y_deg",
        Kind::F32,
        "°",
        "tilt about the skin's y axis at which it is held",
        ALWAYS,
        |_, _, t, s| s.number(t.tilt_deg[1]),
    ),
    ("force_n", Kind::F32, "N", "normal force", ALWAYS, |_, _, t, s| {
        s.number(t.force_n)
    }),
    (
        "poses_refused",
        Kind::I32,
        "",
        "poses that were drawn before and tip over, miss the skin or meet another object",
        ALWAYS,
        |_, _, t, s| {
            s.integer(t.refused);
        },
    ),
    (
        "size_x_m",
        Kind::F32,
        "m",
        "extent of the shape along its own x",
        OF_SHAPES,
        |c, _, _, s| s.maybe(c.shape.map(|f| f.size_m[0])),
    ),
    (
        "size_y_m",
        Kind::F32,
        "m",
        "extent of the shape along its own y",
        OF_SHAPES,
        |c, _, _, s| s.maybe(c.shape.map(|f| f.size_m[1])),
    ),
    (
        "relief_m",
        Kind::F32,
        "m",
        "relief of the shape's underside",
        OF_SHAPES,
        |c, _, _, s| s.maybe(c.shape.map(|f| f.relief_m)),
    ),
    (
        "edge_m",
        Kind::F32,
        "m",
        "radius of the shape's edges",
        OF_SHAPES,
        |c, _, _, s| s.maybe(c.shape.map(|f| f.edge_m)),
    ),
    (
        "area_m2",
        Kind::F32,
        "m²",
        "area of the shape's outline",
        OF_SHAPES,
        |c, _, _, s| s.maybe(c.shape.map(|f| f.area_m2)),
    ),
    ("holes", Kind::I32, "", "holes of the shape", OF_SHAPES, |c, _, _, s| {
        s.integer(c.shape.map_or(0, |f| f.holes.into()))
    }),
];

/// Columns of the data set of `spec`, in their order.
#[must_use]
pub fn columns(spec: &Spec) -> Vec<Column> {
    let rows = ROW_COLUMNS.iter().filter(|(.., has, _)| has(spec));
    let rows = rows.map(|(name, kind, length, unit, description, ..)| Column {
        name: (*name).to_owned(),
        kind: *kind,
        length: length.map(|length| length(spec)),
        unit,
        description,
    });
    let objects = slots(spec).map(|(slot, (name, kind, unit, description, ..))| Column {
        name: if slot == 0 {
            (*name).to_owned()
        } else {
            format!("{name}_{}", slot + 1)
        },
        kind: *kind,
        length: None,
        unit,
        description,
    });
    rows.chain(objects).collect()
}

/// Adds `row` to the stores of all columns, which are in the order of [`columns`].
pub(crate) fn put(row: &Row<'_>, stores: &mut [Store]) {
    let mut stores = stores.iter_mut();
    let spec = row.spec();
    for ((.., fill), store) in ROW_COLUMNS.iter().filter(|(.., has, _)| has(spec)).zip(&mut stores) {
        fill(row, store);
    }
    for ((slot, (.., fill)), store) in slots(spec).zip(&mut stores) {
        match row.object(slot) {
            Some((choice, number, touch)) => fill(choice, number, touch, store),
            None => store.null(),
        }
    }
}

/// The columns of every object, object by object.
fn slots(spec: &Spec) -> impl Iterator<Item = (usize, &'static ObjectColumn)> {
    let has = |column: &&'static ObjectColumn| (column.4)(spec);
    (0..spec.most_objects()).flat_map(move |slot| OBJECT_COLUMNS.iter().filter(has).map(move |column| (slot, column)))
}
