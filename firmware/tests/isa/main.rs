//! The AVRxt core against the instruction-set manual and against programs written by others.
//!
//! `core`: vectors worked out by hand from DS40002198, and its AVRxt timing. `oracle`: random programs against
//! yasimavr, every opcode against binutils.

mod asm;
mod core;
mod machine;
mod oracle;
