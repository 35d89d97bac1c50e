//! Every parser of files that others make, behind one kind of function: bytes in, nothing out, no panic.

use spts::session::{Session, read_npy};
use spts::{Profile, Scene};
use spts_contact::mesh::{MeshOptions, Repair};
use std::path::Path;

/// A parser that is given whatever bytes there are. What it makes of them is dropped.
pub type Parser = fn(&[u8]);

/// All parsers, by the name of their fuzz target and of the folder of their corpus.
pub const PARSERS: &[(&str, Parser)] = &[
    ("obj", obj),
    ("glb", glb),
    ("stl", stl),
    ("mat", mat),
    ("npy", npy),
    ("answer", answer),
    ("session", session),
    ("scene", scene),
    ("profile", profile),
    ("image", image),
    ("seeds", seeds),
];

/// Taxels of the skin that a profile is checked for, and of the images of answers.
const TAXELS: u32 = 100;
/// Classes that an answer may name.
const CLASSES: usize = 17;

/// A mesh that is not closed is read all the same.
fn as_it_is(scale: f64) -> MeshOptions {
    MeshOptions { scale, repair: Repair::NearSide, centre: true }
}

/// A mesh in OBJ.
pub fn obj(bytes: &[u8]) {
    for options in [1e-3.into(), as_it_is(1e-3)] {
        let _ = spts_contact::mesh::read_obj(bytes, options, "fuzz.obj");
    }
}

/// A mesh in GLB.
pub fn glb(bytes: &[u8]) {
    for options in [1.0.into(), as_it_is(1.0)] {
        let _ = spts_contact::mesh::read_glb(bytes, options, "fuzz.glb");
    }
}

/// A mesh in STL.
pub fn stl(bytes: &[u8]) {
    for options in [1e-3.into(), as_it_is(1e-3)] {
        let _ = spts_contact::mesh::read_stl(bytes, options, "fuzz.stl");
    }
}

/// The variable `C` of a MATLAB file.
pub fn mat(bytes: &[u8]) {
    let _ = spts::data::parse_mat(bytes.to_vec(), &["C"], Path::new("fuzz.mat"));
}

/// A NumPy array of a session.
pub fn npy(bytes: &[u8]) {
    in_folder("a.npy", bytes, |folder| {
        let _ = read_npy(&folder.join("a.npy"));
    });
}

/// A line of the output of an external program.
pub fn answer(bytes: &[u8]) {
    for line in bytes.split_inclusive(|b| *b == b'\n') {
        let _ = spts_eval::external::check_line(line, TAXELS as usize, CLASSES);
    }
}

/// The description of a session, beside which no array lies.
pub fn session(bytes: &[u8]) {
    in_folder("session.json", bytes, |folder| {
        let _ = Session::read(folder);
    });
}

/// A scene. The files that it names are looked for in an empty folder.
pub fn scene(bytes: &[u8]) {
    let Ok(text) = spts_input::text(bytes) else { return };
    // the other parser of the same text is the one that fills in what a command line says
    let _ = text.parse::<toml::Table>();
    in_folder("scene.toml", bytes, |folder| {
        let _ = Scene::load(folder.join("scene.toml"));
    });
}

/// A readout profile.
pub fn profile(bytes: &[u8]) {
    let Ok(text) = spts_input::text(bytes) else { return };
    if let Ok(profile) = Profile::from_toml(text) {
        let _ = profile.validate(TAXELS);
    }
}

/// A flash image in Intel hex.
pub fn image(bytes: &[u8]) {
    if let Ok(text) = spts_input::text(bytes) {
        let _ = spts_firmware::Image::from_hex(text);
    }
}

/// A list of seeds.
pub fn seeds(bytes: &[u8]) {
    if let Ok(text) = spts_input::text(bytes) {
        let _ = spts_circuit::parse_seeds(text);
    }
}

/// Calls `read` with a folder that holds nothing but the file `name` of these bytes. A machine without room for it
/// shows as parsers that never run, not as their fault.
fn in_folder(name: &str, bytes: &[u8], read: impl Fn(&Path)) {
    let Ok(folder) = tempfile::tempdir() else { return };
    if std::fs::write(folder.path().join(name), bytes).is_ok() {
        read(folder.path());
    }
}
