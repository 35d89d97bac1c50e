//! MuJoCo's library is that of PyPI's package, which lies beside this one.

fn main() {
    println!("cargo::rustc-link-arg-cdylib=-Wl,-rpath,$ORIGIN/../mujoco");
    println!("cargo::rerun-if-changed=build.rs");
}
