//! The columns of a data set: tables with one line a column, and the values of a column on their way into a file.

use crate::make::{Object, Row};
use crate::spec::{Label, ObjectSource, Spec};
use arrow_array::builder::{BooleanBuilder, PrimitiveBuilder, StringBuilder};
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{ArrayRef, FixedSizeListArray};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};
use serde::Serialize;
use spts::recon::metrics::{SUPPORT_THRESHOLD, support};
use std::collections::HashMap;
use std::sync::Arc;

/// A column of a data set, as `spts dataset schema` shows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Type of a value.
    pub kind: Kind,
    /// Length of the list in each row; `None` for a single value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<usize>,
    /// Unit; empty without one.
    pub unit: &'static str,
    /// What the column contains.
    pub description: &'static str,
}

impl Column {
    /// Type as text, such as `float32[100]`.
    pub fn type_name(&self) -> String {
        let name = match self.kind {
            Kind::Text => "text",
            Kind::Bool => "bool",
            Kind::I32 => "int32",
            Kind::I64 => "int64",
            Kind::F32 => "float32",
        };
        self.length.map_or_else(|| name.to_owned(), |length| format!("{name}[{length}]"))
    }
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Text.
    Text,
    /// True or false.
    Bool,
    /// 32-bit integer.
    I32,
    /// 64-bit integer.
    I64,
    /// 32-bit float.
    F32,
}

impl Kind {
    fn data_type(self) -> DataType {
        match self {
            Self::Text => DataType::Utf8,
            Self::Bool => DataType::Boolean,
            Self::I32 => DataType::Int32,
            Self::I64 => DataType::Int64,
            Self::F32 => DataType::Float32,
        }
    }

    /// Bytes of a value in memory; of a text about so many.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::Text => 8,
        }
    }

    fn item(self) -> Arc<Field> {
        Arc::new(Field::new("item", self.data_type(), false))
    }
}

/// Which specs have a column.
type Has = fn(&Spec) -> bool;
/// How long a list column is.
type Length = fn(&Spec) -> usize;
/// Name, type, length, unit, description, which specs have it, and how a row fills it.
type RowColumn = (&'static str, Kind, Option<Length>, &'static str, &'static str, Has, fn(&Row<'_>, &mut Store));
/// Name, type, unit, description, which specs have it, and how an object fills it.
type ObjectColumn = (&'static str, Kind, &'static str, &'static str, Has, fn(&Object<'_>, &mut Store));

const ONE: Option<Length> = None;
/// One value a taxel.
const TAXELS: Option<Length> = Some(|spec| spec.skin().taxels());
/// One value a measurement.
const SAMPLES: Option<Length> = Some(|spec| spec.config().record.measurements);
/// One value a measurement and taxel, row by row of Φ.
const PHI: Option<Length> = Some(|spec| spec.config().record.measurements * spec.skin().taxels());

const ALWAYS: Has = |_| true;
const RASTER: Has = |spec| spec.config().record.raster;
const DROPS: Has = Spec::drops;
/// Contacts that are simulated: frames say nothing of where and how hard an object is pressed.
const POSED: Has = |spec| spec.frame_law().is_none();
const SHAPES: Has = |spec| spec.config().object.from == ObjectSource::Shapes;

/// Columns of a press and its window.
#[rustfmt::skip]
const ROW_COLUMNS: &[RowColumn] = &[
    ("index", Kind::I64, ONE, "", "number of the row, from 0", ALWAYS, |r, s| s.integer(r.index)),
    ("split", Kind::Text, ONE, "", "train, validation or test", ALWAYS, |r, s| s.text(r.split())),
    ("press", Kind::I64, ONE, "", "number of the press; all its windows are in one split", ALWAYS,
        |r, s| s.integer(r.press.number)),
    ("window", Kind::I32, ONE, "", "number of the window within its press, from 0", ALWAYS,
        |r, s| s.integer(r.window as u64)),
    ("objects", Kind::I32, ONE, "", "number of objects on the skin", ALWAYS, |r, s| s.integer(r.objects() as u64)),
    ("skin_seed", Kind::I64, ONE, "", "specimen of the skin: its taxels and parts", ALWAYS,
        |r, s| s.integer(r.skin.seed)),
    ("session", Kind::I64, ONE, "", "session of the skin", ALWAYS, |r, s| s.integer(r.skin.number)),
    ("faults", Kind::I32, ONE, "", "number of faulty cells", ALWAYS, |r, s| s.integer(r.skin.faults as u64)),
    ("presses_before", Kind::I32, ONE, "", "presses of the same kind before this one in the session", ALWAYS,
        |r, s| s.integer(r.press.presses_before as u64)),
    ("time_s", Kind::F32, ONE, "s", "time from the touch to the first measurement, below 0 before it", ALWAYS,
        |r, s| s.number(r.time_s())),
    ("contact_force_n", Kind::F32, ONE, "N", "normal force on the skin in this window: what the pressure adds up to",
        Spec::knows_pressure, |r, s| s.number(r.contact_force_n())),
    ("over_edge", Kind::Bool, ONE, "", "whether a part of an object lies beside the sheet", POSED,
        |r, s| s.flags(&[(0..r.objects()).any(|k| r.object(k).is_some_and(|object| object.touch.over_edge))])),
    ("saturated", Kind::I32, ONE, "", "samples of y at an end of the converter or at a rail", ALWAYS,
        |r, s| s.integer(r.saturated()[0] as u64)),
    ("saturated_raster", Kind::I32, ONE, "", "the same of the raster scan", RASTER,
        |r, s| s.integer(r.saturated()[1] as u64)),
    ("first_row", Kind::I64, ONE, "", "row of Φ of the first measurement, from the loading of the seeds; generator and \
        seeds are in the file's footer", ALWAYS, |r, s| s.integer(r.first_row())),
    ("pressure_pa", Kind::F32, TAXELS, "Pa", "true mean pressure over every taxel's cell, row by row of the skin",
        |spec| spec.has(Label::Pressure), |r, s| s.numbers(r.pressure().values())),
    ("conductance_s", Kind::F32, TAXELS, "S", "true conductance of every taxel", |spec| spec.has(Label::Conductance),
        |r, s| s.numbers(r.conductance().values())),
    ("support", Kind::Bool, TAXELS, "", "taxels above 23 % of the largest conductance",
        |spec| spec.has(Label::Support),
        |r, s| {
            let mut touched = Vec::new();
            support(r.conductance().values(), SUPPORT_THRESHOLD, &mut touched);
            s.flags(&touched);
        }),
    ("image_v", Kind::F32, TAXELS, "V", "image as the raster scan has it, noise included", RASTER,
        |r, s| s.numbers(r.image())),
    ("y_v", Kind::F32, SAMPLES, "V", "the samples of the one wire", |spec| !spec.config().record.codes,
        |r, s| s.numbers(r.volts())),
    ("y_code", Kind::I32, SAMPLES, "", "the samples of the one wire, as codes of the converter",
        |spec| spec.config().record.codes, |r, s| r.codes().for_each(|code| s.signed(code.into()))),
    ("phi", Kind::F32, PHI, "", "Φ of the samples: measurements × taxels, row by row",
        |spec| spec.config().record.phi, |r, s| s.numbers(&r.phi())),
];

/// Columns of every object; those of the second and third end in `_2` and `_3` and are null where there is none.
#[rustfmt::skip]
const OBJECT_COLUMNS: &[ObjectColumn] = &[
    ("object", Kind::Text, "", "name of the object, or family of the shape", ALWAYS, |o, s| s.text(&o.choice.name)),
    ("label", Kind::I32, "", "class: the object's label, or the place in the list of families or files", ALWAYS,
        |o, s| s.signed(o.choice.label.into())),
    ("shape", Kind::I64, "", "number of the shape", ALWAYS, |o, s| s.integer(o.number)),
    ("x_m", Kind::F32, "m", "place of its origin from the middle of the sheet, to large columns", POSED,
        |o, s| s.number(o.touch.position_m[0])),
    ("y_m", Kind::F32, "m", "the same to small rows", POSED, |o, s| s.number(o.touch.position_m[1])),
    ("height_m", Kind::F32, "m", "height of its origin over the skin's free surface", POSED,
        |o, s| s.number(o.height_m)),
    ("rotation_deg", Kind::F32, "°", "rotation about the skin's normal, counter-clockwise from above", POSED,
        |o, s| s.number(o.touch.rotation_deg)),
    ("tilt_x_deg", Kind::F32, "°", "tilt about the skin's x axis at which it is held", POSED,
        |o, s| s.number(o.touch.tilt_deg[0])),
    ("tilt_y_deg", Kind::F32, "°", "tilt about the skin's y axis at which it is held", POSED,
        |o, s| s.number(o.touch.tilt_deg[1])),
    ("force_n", Kind::F32, "N", "normal force on it: the plateau of a course, 0 of a drop", POSED,
        |o, s| s.number(o.touch.force_n)),
    ("poses_refused", Kind::I32, "", "poses that were drawn before and tip over, miss the skin or meet another object",
        POSED, |o, s| s.integer(o.touch.refused)),
    ("size_x_m", Kind::F32, "m", "extent of the shape along its own x", SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.size_m[0]))),
    ("size_y_m", Kind::F32, "m", "extent of the shape along its own y", SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.size_m[1]))),
    ("relief_m", Kind::F32, "m", "relief of the shape's underside", SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.relief_m))),
    ("edge_m", Kind::F32, "m", "radius of the shape's edges", SHAPES, |o, s| s.maybe(o.choice.shape.map(|f| f.edge_m))),
    ("area_m2", Kind::F32, "m²", "area of the shape's outline", SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.area_m2))),
    ("holes", Kind::I32, "", "holes of the shape", SHAPES,
        |o, s| s.integer(o.choice.shape.map_or(0, |f| f.holes.into()))),
    ("drop_height_m", Kind::F32, "m", "height of the ball's lowest point when it is let go", DROPS,
        |o, s| s.maybe(o.touch.ball.map(|b| b.height_m))),
    ("mass_kg", Kind::F32, "kg", "mass of the ball", DROPS, |o, s| s.maybe(o.touch.ball.map(|b| b.mass_kg))),
    ("radius_m", Kind::F32, "m", "radius of the ball", DROPS, |o, s| s.maybe(o.touch.ball.map(|b| b.radius_m))),
    ("speed_m_per_s", Kind::F32, "m/s", "speed of the ball at its first touch", DROPS,
        |o, s| s.maybe(o.touch.ball.map(|b| b.speed_m_per_s))),
];

/// The columns of the data set of `spec`, in order.
///
/// ```
/// use spts_dataset::{Spec, columns};
///
/// let columns = columns(&Spec::load("random-shapes", &toml::Table::new())?);
/// let pressure = columns.iter().find(|column| column.name == "pressure_pa").expect("a label");
/// assert_eq!((pressure.type_name().as_str(), pressure.unit), ("float32[100]", "Pa"));
/// # Ok::<(), spts::Refusal>(())
/// ```
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
        name: match slot {
            0 => (*name).to_owned(),
            _ => format!("{name}_{}", slot + 1),
        },
        kind: *kind,
        length: None,
        unit,
        description,
    });
    rows.chain(objects).collect()
}

/// Arrow schema of the files of `spec`.
pub(crate) fn schema(spec: &Spec) -> SchemaRef {
    let fields = columns(spec).into_iter().map(|column| {
        let metadata = [("unit", column.unit), ("description", column.description)];
        let metadata = metadata.into_iter().filter(|(_, text)| !text.is_empty());
        let metadata: HashMap<String, String> = metadata.map(|(key, text)| (key.to_owned(), text.to_owned())).collect();
        let field = match column.length {
            None => Field::new(column.name, column.kind.data_type(), true),
            Some(length) => {
                let list = DataType::FixedSizeList(column.kind.item(), list_length(length));
                Field::new(column.name, list, false)
            }
        };
        field.with_metadata(metadata)
    });
    Arc::new(Schema::new(fields.collect::<Vec<_>>()))
}

/// Empty stores of all columns, in the order of [`columns`].
pub(crate) fn stores(spec: &Spec) -> Vec<Store> {
    let all = columns(spec).into_iter();
    all.map(|column| Store::new(column.kind, column.length)).collect()
}

/// Adds `row` to the stores of all columns, which are in the order of [`columns`].
pub(crate) fn put(row: &Row<'_>, stores: &mut [Store]) {
    let mut stores = stores.iter_mut();
    let spec = row.spec;
    for ((.., fill), store) in ROW_COLUMNS.iter().filter(|(.., has, _)| has(spec)).zip(&mut stores) {
        fill(row, store);
    }
    for ((slot, (.., fill)), store) in slots(spec).zip(&mut stores) {
        match row.object(slot) {
            Some(object) => fill(&object, store),
            None => store.null(),
        }
    }
}

/// The columns of every object, object by object.
fn slots(spec: &Spec) -> impl Iterator<Item = (usize, &'static ObjectColumn)> {
    let has = |column: &&'static ObjectColumn| (column.4)(spec);
    (0..spec.most_objects()).flat_map(move |slot| OBJECT_COLUMNS.iter().filter(has).map(move |column| (slot, column)))
}

/// The length of a list as Arrow has it; a spec's limits keep it far below the largest.
fn list_length(length: usize) -> i32 {
    i32::try_from(length).unwrap_or(i32::MAX)
}

/// Values of a column for some rows, before they are written.
pub(crate) struct Store {
    values: Values,
    kind: Kind,
    length: Option<usize>,
}

enum Values {
    Text(StringBuilder),
    Bool(BooleanBuilder),
    I32(PrimitiveBuilder<Int32Type>),
    I64(PrimitiveBuilder<Int64Type>),
    F32(PrimitiveBuilder<Float32Type>),
}

/// The same of the values of any type.
macro_rules! any_type {
    ($values:expr, $builder:ident => $done:expr) => {
        match $values {
            Values::Text($builder) => $done,
            Values::Bool($builder) => $done,
            Values::I32($builder) => $done,
            Values::I64($builder) => $done,
            Values::F32($builder) => $done,
        }
    };
}

impl Store {
    pub(crate) fn new(kind: Kind, length: Option<usize>) -> Self {
        Self {
            values: match kind {
                Kind::Text => Values::Text(StringBuilder::new()),
                Kind::Bool => Values::Bool(BooleanBuilder::new()),
                Kind::I32 => Values::I32(PrimitiveBuilder::new()),
                Kind::I64 => Values::I64(PrimitiveBuilder::new()),
                Kind::F32 => Values::F32(PrimitiveBuilder::new()),
            },
            kind,
            length,
        }
    }

    /// Adds a text.
    pub(crate) fn text(&mut self, value: &str) {
        if let Values::Text(values) = &mut self.values {
            values.append_value(value);
        }
    }

    /// Adds a list of truths, or one.
    pub(crate) fn flags(&mut self, new: &[bool]) {
        if let Values::Bool(values) = &mut self.values {
            values.append_slice(new);
        }
    }

    /// Adds a whole number, which the spec's limits keep within the type.
    pub(crate) fn integer(&mut self, value: u64) {
        self.signed(i64::try_from(value).unwrap_or(i64::MAX));
    }

    /// Adds a whole number.
    pub(crate) fn signed(&mut self, value: i64) {
        match &mut self.values {
            Values::I32(values) => values.append_value(i32::try_from(value).unwrap_or(i32::MAX)),
            Values::I64(values) => values.append_value(value),
            _ => {}
        }
    }

    /// Adds a number.
    pub(crate) fn number(&mut self, value: f64) {
        self.numbers(&[value]);
    }

    /// Adds a number, if there is one.
    pub(crate) fn maybe(&mut self, value: Option<f64>) {
        match value {
            Some(value) => self.number(value),
            None => self.null(),
        }
    }

    /// Adds a list of numbers.
    #[expect(clippy::cast_possible_truncation, reason = "files hold single precision")]
    pub(crate) fn numbers(&mut self, new: &[f64]) {
        if let Values::F32(values) = &mut self.values {
            new.iter().for_each(|value| values.append_value(*value as f32));
        }
    }

    /// Adds that there is no value.
    pub(crate) fn null(&mut self) {
        any_type!(&mut self.values, values => values.append_null());
    }

    /// The values so far as an array, after which there are none.
    ///
    /// # Errors
    /// [`ArrowError`] when a row had a list of another length.
    pub(crate) fn take(&mut self) -> Result<ArrayRef, ArrowError> {
        let flat: ArrayRef = any_type!(&mut self.values, values => Arc::new(values.finish()));
        let Some(length) = self.length else { return Ok(flat) };
        let lists = FixedSizeListArray::try_new(self.kind.item(), list_length(length), flat, None)?;
        Ok(Arc::new(lists))
    }
}
