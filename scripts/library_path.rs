//! Build script of the packages whose programs and tests need MuJoCo: where these look for the library. That is in
//! `third_party/` of this repository, as seen from `target/release` and from the folders in it, and in `../lib`, where
//! `make install` puts it.

/// Says so to the linker on Linux; on other systems the twin is built without MuJoCo.
#[allow(clippy::print_stdout, reason = "Cargo reads what a build script prints")]
pub(crate) fn main() {
    println!("cargo::rerun-if-changed=Cargo.toml");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        let folders = ["../../third_party/mujoco/lib", "../../../third_party/mujoco/lib", "../lib"];
        let path = folders.map(|folder| format!("$ORIGIN/{folder}")).join(":");
        println!("cargo::rustc-link-arg=-Wl,-rpath,{path}");
    }
}
