//! The columns of an object on the skin.

use super::row::ALWAYS;
use crate::make::{Ball, Object};
use crate::spec::{ObjectSource, Spec};
use crate::store::{Kind, Store};

/// Name, type, unit, description, which specs have it, and the value of an object.
pub(super) type ObjectColumn = (
    &'static str,
    Kind,
    &'static str,
    &'static str,
    fn(&Spec) -> bool,
    fn(&Object<'_>, &mut Store),
);

const OF_DROPS: fn(&Spec) -> bool = Spec::drops;
const OF_SHAPES: fn(&Spec) -> bool = |spec| spec.config().object.from == ObjectSource::Shapes;

/// Columns of every object; those of the second and third end in `_2` and `_3` and are null where there is none.
pub(super) const OBJECT_COLUMNS: &[ObjectColumn] = &[
    (
        "object",
        Kind::Text,
        "",
        "name of the object, or family of the shape",
        ALWAYS,
        |o, s| s.text(&o.choice.name),
    ),
    (
        "label",
        Kind::I32,
        "",
        "class: the object's label, or the place in the list of families or files",
        ALWAYS,
        |o, s| {
            s.signed(i64::from(o.choice.label));
        },
    ),
    ("shape", Kind::I64, "", "number of the shape", ALWAYS, |o, s| {
        s.integer(o.number)
    }),
    (
        "x_m",
        Kind::F32,
        "m",
        "place of its origin from the middle of the sheet, to large columns",
        ALWAYS,
        |o, s| s.number(o.touch.position_m[0]),
    ),
    ("y_m", Kind::F32, "m", "the same to small rows", ALWAYS, |o, s| {
        s.number(o.touch.position_m[1])
    }),
    (
        "height_m",
        Kind::F32,
        "m",
        "height of its origin over the skin's free surface",
        ALWAYS,
        |o, s| s.number(o.height_m),
    ),
    (
        "rotation_deg",
        Kind::F32,
        "°",
        "rotation about the skin's normal, counter-clockwise from above",
        ALWAYS,
        |o, s| s.number(o.touch.rotation_deg),
    ),
    (
        "tilt_x_deg",
        Kind::F32,
        "°",
        "tilt about the skin's x axis at which it is held",
        ALWAYS,
        |o, s| s.number(o.touch.tilt_deg[0]),
    ),
    (
        "tilt_y_deg",
        Kind::F32,
        "°",
        "tilt about the skin's y axis at which it is held",
        ALWAYS,
        |o, s| s.number(o.touch.tilt_deg[1]),
    ),
    (
        "force_n",
        Kind::F32,
        "N",
        "normal force on it: the plateau of a course, 0 of a drop",
        ALWAYS,
        |o, s| s.number(o.touch.force_n),
    ),
    (
        "poses_refused",
        Kind::I32,
        "",
        "poses that were drawn before and tip over, miss the skin or meet another object",
        ALWAYS,
        |o, s| {
            s.integer(o.touch.refused);
        },
    ),
    (
        "size_x_m",
        Kind::F32,
        "m",
        "extent of the shape along its own x",
        OF_SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.size_m[0])),
    ),
    (
        "size_y_m",
        Kind::F32,
        "m",
        "extent of the shape along its own y",
        OF_SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.size_m[1])),
    ),
    (
        "relief_m",
        Kind::F32,
        "m",
        "relief of the shape's underside",
        OF_SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.relief_m)),
    ),
    (
        "edge_m",
        Kind::F32,
        "m",
        "radius of the shape's edges",
        OF_SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.edge_m)),
    ),
    (
        "area_m2",
        Kind::F32,
        "m²",
        "area of the shape's outline",
        OF_SHAPES,
        |o, s| s.maybe(o.choice.shape.map(|f| f.area_m2)),
    ),
    ("holes", Kind::I32, "", "holes of the shape", OF_SHAPES, |o, s| {
        s.integer(o.choice.shape.map_or(0, |f| f.holes.into()))
    }),
    (
        "drop_height_m",
        Kind::F32,
        "m",
        "height of the ball's lowest point when it is let go",
        OF_DROPS,
        |o, s| s.maybe(ball(o).map(|b| b.height_m)),
    ),
    ("mass_kg", Kind::F32, "kg", "mass of the ball", OF_DROPS, |o, s| {
        s.maybe(ball(o).map(|b| b.mass_kg))
    }),
    ("radius_m", Kind::F32, "m", "radius of the ball", OF_DROPS, |o, s| {
        s.maybe(ball(o).map(|b| b.radius_m))
    }),
    (
        "speed_m_per_s",
        Kind::F32,
        "m/s",
        "speed of the ball at its first touch",
        OF_DROPS,
        |o, s| s.maybe(ball(o).map(|b| b.speed_m_per_s)),
    ),
];

fn ball(object: &Object<'_>) -> Option<Ball> {
    object.touch.ball
}
