//! The ATtiny412: an AVRxt core with the peripherals that a cell uses, on the time base of its 20 MHz oscillator.
//!
//! Peripherals have the register addresses of the manufacturer's device description. Emulated is what a cell's program
//! touches: SRAM, EEPROM, CPUINT with both levels, configuration change protection, the main clock's prescaler on and
//! off, the clock pin PA3 with its interrupt, TWI0 as a client byte by byte, DAC0, idle sleep, software reset and the
//! overflow of TCA0. Anything else is recorded as a [`Fault`] and has no effect.
//!
//! Left out: the start-up time behind a reset, the input synchroniser (up to three cycles, the same for all cells),
//! analogue settling of the DAC, standby and power-down, more than one wait state an access to EEPROM. Races are
//! resolved to a whole instruction.
//!
//! ```
//! use spts_firmware::{Image, attiny412::Device};
//!
//! let mut cell = Device::new(Device::program(Image::shipped().flash())?, &[8]);
//! let mut listing = vec![];
//! cell.trace_until(20_000, |record| listing.push(record.to_string()));
//! assert!(cell.is_asleep() && cell.dac_output() == Some(126));
//! assert!(listing[0].contains("rjmp"));
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod device;
mod pins;
mod space;
mod system;
mod tca;
#[cfg(test)]
mod tests;
mod twi;

pub use device::{Device, OSCILLATOR_HZ, TraceRecord, TraceStep};
pub use system::{Fault, Faults};
