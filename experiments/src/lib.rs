//! The spts command line: simulate, validate, reproduce.
