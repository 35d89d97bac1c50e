//! Writes the seventeen objects as OBJ and GLB, and their placements as CSV, into `contact/assets` (or the directory
//! given).
//!
//! `cargo run -p spts-contact --example generate_objects [DIRECTORY]`

use spts_contact::objects::{OBJECTS, placements_csv};
use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets");
    let directory = std::env::args_os().nth(1).map_or(default, PathBuf::from);
    std::fs::create_dir_all(&directory)?;
    for object in OBJECTS {
        let mesh = (object.build)();
        std::fs::write(directory.join(format!("{}.obj", object.name)), mesh.to_obj(object.name))?;
        std::fs::write(directory.join(format!("{}.glb", object.name)), mesh.to_glb(object.name))?;
    }
    std::fs::write(directory.join("placements.csv"), placements_csv())
}
