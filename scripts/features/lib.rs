//! Nothing but its dependencies: crates of others, with every feature that any part of the repository turns on. Tests,
//! examples and the Python package depend on it, and so share what Cargo builds; without it Cargo would build most
//! crates again for each of them.
