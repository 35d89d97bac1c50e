//! MuJoCo's library, opened when a scene first needs it. Programs start without it, and only scenes ask for it.
//!
//! `mujoco-rs` declares MuJoCo's functions and links no library (`DOCS_RS` in `.cargo/config.toml` tells its build
//! script so). They are defined here, and forward to the library that [`open`] has found.

#![expect(non_snake_case, reason = "the functions have MuJoCo's names")]

use libloading::Library;
use mujoco_rs::mujoco_c::{
    mjData, mjModel, mjVFS, mjrContext, mjrRect, mjtNum, mjvCamera, mjvOption, mjvPerturb, mjvScene,
};
use spts_input::Refusal;
use std::ffi::{CStr, c_char, c_int, c_uchar, c_void};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

/// The one version of MuJoCo that the binding is made for: every version lays its structures out differently.
pub const MUJOCO_VERSION: &str = "3.17.0";

/// Environment variable with the library's path, for a library in another place.
pub const PATH_VARIABLE: &str = "SPTS_MUJOCO";

/// Name of the library's file.
const FILE: &str = if cfg!(target_os = "macos") { "libmujoco.3.17.0.dylib" } else { "libmujoco.so.3.17.0" };

/// Where a checkout keeps the library (`scripts/setup.sh`).
const IN_CHECKOUT: &str = "third_party/mujoco/lib";

/// Folders that [`look_in`] was told.
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// The library's functions, once it is open.
static FUNCTIONS: OnceLock<Functions> = OnceLock::new();

/// Makes the structure of the library's functions, and a definition of each for `mujoco-rs` to call.
macro_rules! functions {
    ($(fn $name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?;)*) => {
        /// The functions of MuJoCo that the twin and its tests call.
        struct Functions {
            $($name: unsafe extern "C" fn($($type),*) $(-> $result)?,)*
        }

        impl Functions {
            #[expect(unsafe_code, reason = "symbols of a C library")]
            fn of(library: &'static Library) -> Result<Self, libloading::Error> {
                // SAFETY: the types are those of the binding of this version, as the constant below checks
                Ok(Self { $($name: unsafe { *library.get(concat!(stringify!($name), "\0").as_bytes())? },)* })
            }
        }

        /// The signatures above are those of the binding.
        const _: () = {
            $(let _: unsafe extern "C" fn($($type),*) $(-> $result)? = mujoco_rs::mujoco_c::$name;)*
        };

        #[expect(unsafe_code, reason = "definitions of C functions")]
        mod definitions {
            use super::*;

            $(
                // for this program or extension alone: another MuJoCo in the process keeps its own
                #[cfg(target_os = "linux")]
                std::arch::global_asm!(concat!(".hidden ", stringify!($name)));

                // SAFETY: no other definition has this name, for `mujoco-rs` links none
                #[unsafe(no_mangle)]
                unsafe extern "C" fn $name($($argument: $type),*) $(-> $result)? {
                    // SAFETY: what the caller has to hold is what the library wants
                    unsafe { (loaded().$name)($($argument),*) }
                }
            )*
        }
    };
}

functions! {
    fn mj_addBufferVFS(vfs: *mut mjVFS, name: *const c_char, buffer: *const c_void, bytes: c_int) -> c_int;
    fn mj_defaultVFS(vfs: *mut mjVFS);
    fn mj_deleteVFS(vfs: *mut mjVFS);
    fn mj_loadXML(file: *const c_char, vfs: *const mjVFS, error: *mut c_char, bytes: c_int) -> *mut mjModel;
    fn mj_deleteModel(model: *mut mjModel);
    fn mj_makeData(model: *const mjModel) -> *mut mjData;
    fn mj_resetData(model: *const mjModel, data: *mut mjData);
    fn mj_deleteData(data: *mut mjData);
    fn mj_forward(model: *const mjModel, data: *mut mjData);
    fn mj_step(model: *const mjModel, data: *mut mjData);
    fn mj_step1(model: *const mjModel, data: *mut mjData);
    fn mj_step2(model: *const mjModel, data: *mut mjData);
    fn mj_name2id(model: *const mjModel, kind: c_int, name: *const c_char) -> c_int;
    fn mj_objectVelocity(
        model: *const mjModel, data: *const mjData, kind: c_int, id: c_int, velocity: *mut [mjtNum; 6], local: c_int
    );
    fn mj_version() -> c_int;
    fn mj_versionString() -> *const c_char;
    fn mjv_defaultCamera(camera: *mut mjvCamera);
    fn mjv_defaultOption(option: *mut mjvOption);
    fn mjv_defaultPerturb(perturb: *mut mjvPerturb);
    fn mjv_defaultScene(scene: *mut mjvScene);
    fn mjv_makeScene(model: *const mjModel, scene: *mut mjvScene, geoms: c_int);
    fn mjv_freeScene(scene: *mut mjvScene);
    fn mjv_updateScene(
        model: *const mjModel, data: *mut mjData, option: *const mjvOption, perturb: *const mjvPerturb,
        camera: *mut mjvCamera, categories: c_int, scene: *mut mjvScene
    );
    fn mjr_defaultContext(context: *mut mjrContext);
    fn mjr_makeContext(model: *const mjModel, context: *mut mjrContext, font: c_int);
    fn mjr_changeFont(font: c_int, context: *mut mjrContext);
    fn mjr_freeContext(context: *mut mjrContext);
    fn mjr_setBuffer(buffer: c_int, context: *mut mjrContext);
    fn mjr_render(viewport: mjrRect, scene: *mut mjvScene, context: *const mjrContext);
    fn mjr_readPixels(rgb: *mut c_uchar, depth: *mut f32, viewport: mjrRect, context: *const mjrContext);
}

/// Looks for the library in `folder` too: after [`PATH_VARIABLE`], before all other places.
pub fn look_in(folder: PathBuf) {
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).push(folder);
}

/// Opens MuJoCo's library, the first time it is called. In this order: the file that [`PATH_VARIABLE`] names, and no
/// other then; the folders of [`look_in`]; `../lib` beside the program; `third_party/mujoco/lib` of a checkout around
/// the program; the system's own places.
///
/// # Errors
/// [`Refusal`] if it is nowhere, is no library, or is of another version than [`MUJOCO_VERSION`].
pub fn open() -> Result<(), Refusal> {
    /// One thread opens it, the others wait.
    static OPENING: Mutex<()> = Mutex::new(());
    let _opening = OPENING.lock().unwrap_or_else(PoisonError::into_inner);
    if FUNCTIONS.get().is_none() {
        let functions = functions_of(&library_file()?)?;
        FUNCTIONS.get_or_init(|| functions);
    }
    Ok(())
}

/// The functions of the library `file`, which stays open until the process ends.
#[expect(unsafe_code, reason = "a C library")]
fn functions_of(file: &Path) -> Result<Functions, Refusal> {
    let refused = |why: &str| {
        Refusal::new(format!(
            "simulated scenes need MuJoCo {MUJOCO_VERSION}, and {why}; `pip install mujoco=={MUJOCO_VERSION}` brings it for \
             the Python package, and {PATH_VARIABLE} may name its {FILE} anywhere"
        ))
    };
    let library = opened(file).map_err(|error| match other_version() {
        _ if file.components().count() > 1 => refused(&format!("{} cannot be opened: {error}", file.display())),
        Some(other) => refused(&format!("{} is another version", other.display())),
        None => refused("it is not found"),
    })?;
    let library: &'static Library = Box::leak(Box::new(library));
    let functions =
        Functions::of(library).map_err(|_| refused(&format!("{} is no MuJoCo, or another version", file.display())))?;
    // SAFETY: it takes nothing, and answers a text that stays
    let found = unsafe { CStr::from_ptr((functions.mj_versionString)()) }.to_string_lossy();
    if found == MUJOCO_VERSION { Ok(functions) } else { Err(refused(&format!("{} is {found}", file.display()))) }
}

/// The library `file`, which sees its own functions before those of another MuJoCo in the same process.
#[expect(unsafe_code, reason = "a C library")]
fn opened(file: &Path) -> Result<Library, libloading::Error> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: MuJoCo's initialisers have no conditions
    unsafe {
        use libloading::os::unix::{Library as UnixLibrary, RTLD_LOCAL, RTLD_NOW};
        /// `RTLD_DEEPBIND` of the GNU C library.
        const DEEP_BIND: std::ffi::c_int = 8;
        UnixLibrary::open(Some(file), RTLD_NOW | RTLD_LOCAL | DEEP_BIND).map(Library::from)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    // SAFETY: as above
    unsafe {
        Library::new(file)
    }
}

/// A library of MuJoCo of another version, in a folder of [`look_in`].
fn other_version() -> Option<PathBuf> {
    let told = FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let files = told.into_iter().filter_map(|folder| folder.read_dir().ok()).flatten().filter_map(Result::ok);
    let mut others = files.filter(|file| file.file_name().as_encoded_bytes().starts_with(b"libmujoco."));
    others.next().map(|file| file.path())
}

/// The library's file; its mere name where only the system may know it.
fn library_file() -> Result<PathBuf, Refusal> {
    if let Some(named) = std::env::var_os(PATH_VARIABLE).filter(|named| !named.is_empty()) {
        let named = PathBuf::from(named);
        // with its folder: a mere name would be looked for in the system's places
        return match named.canonicalize() {
            Ok(file) if file.is_file() => Ok(file),
            _ => Err(Refusal::new(format!("`{PATH_VARIABLE}` = {} is no file", named.display()))),
        };
    }
    let program = std::env::current_exe().unwrap_or_default();
    let beside = program.parent().map(|folder| folder.join("../lib"));
    let told = FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let checkouts = program.ancestors().skip(1).map(|folder| folder.join(IN_CHECKOUT));
    let places = told.into_iter().chain(beside).chain(checkouts).map(|folder| folder.join(FILE));
    Ok(places.into_iter().find(|file| file.is_file()).unwrap_or_else(|| PathBuf::from(FILE)))
}

/// The library's functions.
fn loaded() -> &'static Functions {
    FUNCTIONS.get().unwrap_or_else(|| panic!("MuJoCo is used before `spts_sim::engine::open`"))
}
