//! Trace of a device, instruction by instruction, for debugging.

use std::fmt;

use super::rstctrl::ResetCause;
use crate::avr::{Core, Program, disassemble};

/// One step of a traced device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceRecord {
    /// Oscillator tick at which the step starts.
    pub tick: u64,
    /// Content of the step.
    pub step: TraceStep,
}

/// Content of a step of a traced device.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum TraceStep {
    /// An instruction.
    Instruction {
        /// Word address.
        pc: u16,
        /// Text in the syntax of a disassembler.
        text: String,
        /// Changed registers, by name, with the new value: r0…r31, SP, SREG.
        changes: Vec<(String, u16)>,
    },
    /// An interrupt is executed.
    Interrupt {
        /// Vector number.
        vector: u8,
    },
    /// The CPU wakes up.
    Wake,
    /// The device is reset.
    Reset {
        /// Why.
        cause: ResetCause,
    },
}

impl fmt::Display for TraceRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>10}  ", self.tick)?;
        match &self.step {
            TraceStep::Instruction { pc, text, changes } => {
                write!(f, "{:04x}  {text:<28}", 2 * u32::from(*pc))?;
                for (name, value) in changes {
                    write!(f, " {name}={value:02x}")?;
                }
                Ok(())
            }
            TraceStep::Interrupt { vector } => write!(f, "----  interrupt {vector}"),
            TraceStep::Wake => write!(f, "----  wake"),
            TraceStep::Reset { cause } => write!(f, "----  reset: {cause:?}"),
        }
    }
}

/// Hears what a running device does.
pub(super) trait Observer {
    /// Whether anything is heard; without, the calls cost nothing.
    const ON: bool;
    /// A step.
    fn hear(&mut self, record: TraceRecord);
}

/// Hears nothing.
pub(super) struct Silent;

impl Observer for Silent {
    const ON: bool = false;
    fn hear(&mut self, _: TraceRecord) {}
}

/// Passes every step on.
pub(super) struct Sink<F>(pub(super) F);

impl<F: FnMut(&TraceRecord)> Observer for Sink<F> {
    const ON: bool = true;
    fn hear(&mut self, record: TraceRecord) {
        (self.0)(&record);
    }
}

/// The instruction that took the core from `before` to `after`.
pub(super) fn instruction(tick: u64, program: &Program, before: &Core, after: &Core) -> TraceRecord {
    let registers = before.registers.iter().zip(&after.registers).enumerate();
    let mut changes: Vec<(String, u16)> = registers
        .filter(|(_, (old, new))| old != new)
        .map(|(k, (_, new))| (format!("r{k}"), u16::from(*new)))
        .collect();
    if before.sp != after.sp {
        changes.push(("SP".into(), after.sp));
    }
    if before.sreg != after.sreg {
        changes.push(("SREG".into(), u16::from(after.sreg)));
    }
    TraceRecord {
        tick,
        step: TraceStep::Instruction {
            pc: before.pc,
            text: disassemble(program, before.pc),
            changes,
        },
    }
}
