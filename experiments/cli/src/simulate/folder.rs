//! The folder of the results of a scene when none is named.

use spts::scene::MESH_COPY;
use spts::simulate::Prepared;
use spts_contact::mesh::MAX_FILE_BYTES;
use std::path::{Path, PathBuf};

/// Folder of all runs that name none.
const OUT: &str = "out";

/// `out/NAME`, where NAME is that of the scene: of the object, or of the file of a mesh. Where the results of another
/// mesh, or of anything else, lie there, a mesh gets the first of `out/NAME_2`, `out/NAME_3`, … in which they do not.
pub(super) fn default_folder(prepared: &Prepared) -> PathBuf {
    let named = |name: &str| Path::new(OUT).join(name);
    let name = prepared.scene.name();
    let is_mesh = |(file, _): &&(String, Vec<u8>)| Path::new(file).file_stem() == Some(MESH_COPY.as_ref());
    let Some((file, bytes)) = prepared.copies.iter().find(is_mesh) else {
        return named(name);
    };
    // the same mesh, whatever its force and place: a run that replaces the one before
    let same = |folder: &Path| spts_input::read(&folder.join(file), MAX_FILE_BYTES).is_ok_and(|there| there == *bytes);
    let others = (2_u32..).map(|number| named(&format!("{name}_{number}")));
    let mut folders = [named(name)].into_iter().chain(others);
    let free = folders.find(|folder| !folder.exists() || same(folder));
    free.unwrap_or_else(|| named(name))
}
