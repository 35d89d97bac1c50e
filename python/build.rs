//! How the extension finds its own definitions of MuJoCo's functions.

/// The extension's own come before those of a MuJoCo that another package has loaded, which may be of another version.
fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-Bsymbolic");
    }
}
