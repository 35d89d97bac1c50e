//! The AVRxt core against the instruction-set manual and against programs written by others.
//!
//! `alu`: every operand of every arithmetic instruction, flags from wide integers. `core`: vectors worked out by hand
//! from DS40002198, and its AVRxt timing. `oracle`: random programs against yasimavr, every opcode against binutils.

mod alu;
mod asm;
mod core;
mod machine;
mod oracle;
