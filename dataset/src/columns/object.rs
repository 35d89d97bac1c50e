//! The columns of an object on the skin.

use super::row::ALWAYS;
use crate::make::Touch;
use crate::spec::{Choice, ObjectSource, Spec};
use crate::store::{Kind, Store};

/// Name, type, unit, description, which specs have it, and the value of an object.
pub(super) type ObjectColumn = (
    &'static str,
    Kind,
    &'static str,
    &'static str,
    fn(&Spec) -> bool,
    fn(&Choice, u64, &Touch, &mut Store),
);

const OF_SHAPES: fn(&Spec) -> bool = |spec| spec.config().object.from == ObjectSource::Shapes;

/// Columns of every object; those of the second and third end in `_2` and `_3` and are null where there is none.
pub(super) const OBJECT_COLUMNS: &[ObjectColumn] = &[
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
