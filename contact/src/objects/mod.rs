//! The seventeen objects that were pressed on the published skin, as closed solids, each with the place where it is
//! pressed.
//!
//! The published text names the objects but gives no sizes. Sizes and places are estimates: a static contact model was
//! fitted to the published raster recordings (`scripts/fit_objects.py`), within plausible sizes of each object.
//!
//! ```
//! use spts_contact::objects::by_name;
//! let tape = by_name("tape").unwrap();
//! let mesh = (tape.build)();
//! assert_eq!((tape.label, mesh.open_edges()), (14, 0));
//! ```

mod bow;
mod finger;
mod household;
mod plates;
mod spec;
mod table;

pub use finger::FINGER;
pub use spec::{ObjectSpec, Placement};
pub use table::{BALL_STIFFNESS_PA_PER_M, OBJECTS};

/// Every object that can be pressed by name: those of [`OBJECTS`], and [`FINGER`].
pub fn pressable() -> impl Iterator<Item = &'static ObjectSpec> {
    OBJECTS.iter().chain([&FINGER])
}

/// The object of [`OBJECTS`] called `name`; `None` if there is none.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static ObjectSpec> {
    OBJECTS.iter().find(|o| o.name == name)
}

/// The placements as CSV text, for scripts in other languages.
#[must_use]
pub fn placements_csv() -> String {
    let mut out = String::from("name,label,row,col,rotation_rad,tilt_x_rad,tilt_y_rad\n");
    for o in OBJECTS {
        let p = o.placement;
        let line = format!(
            "{},{},{},{},{},{},{}\n",
            o.name, o.label, p.row, p.col, p.rotation_rad, p.tilt_x_rad, p.tilt_y_rad
        );
        out.push_str(&line);
    }
    out
}

#[cfg(test)]
mod tests;
