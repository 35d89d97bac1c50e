//! The specifications that ship with the library.

/// Every specification by name, as TOML.
pub const NAMED_SPECS: &[(&str, &str)] = &[
    ("presses-17", include_str!("../../specs/presses-17.toml")),
    ("random-shapes", include_str!("../../specs/random-shapes.toml")),
    ("courses", include_str!("../../specs/courses.toml")),
    ("drops", include_str!("../../specs/drops.toml")),
    ("unseen-shapes", include_str!("../../specs/unseen-shapes.toml")),
    ("skins", include_str!("../../specs/skins.toml")),
    ("faults", include_str!("../../specs/faults.toml")),
    ("large-skin", include_str!("../../specs/large-skin.toml")),
];
