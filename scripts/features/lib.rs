//! Nothing but its dependencies: crates of others, with every feature that any part of the repository turns on. The
//! command line and the examples depend on it, and so tests and the Python package: all share what Cargo builds, and a
//! program writes the same bytes whichever of them it was built with.
