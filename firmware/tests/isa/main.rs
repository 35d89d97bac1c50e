//! The AVRxt core against the instruction-set manual and against programs written by others.
//!
//! `alu`: every operand of every arithmetic instruction, flags from wide integers. `registers`, `memory`, `control`:
//! vectors worked out by hand from DS40002198. `cycles`: its AVRxt timing. `objdump`: every opcode against binutils.
//! `oracle`: random programs against yasimavr.

mod alu;
mod asm;
mod control;
mod cycles;
mod generate;
mod machine;
mod memory;
mod objdump;
mod oracle;
mod registers;
