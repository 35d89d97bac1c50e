//! The `spts` command line.
fn main() {}
