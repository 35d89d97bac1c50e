//! One device: core, memory map and time; and its trace, instruction by instruction, for debugging.

use super::space::{FLASH_LEN, RAM_END, Space};
use super::system::{Accepted, Fault, Faults};
use crate::avr::{Core, Event, Program, disassemble, sreg};
use spts_input::Refusal;
use std::fmt;
use std::sync::Arc;

/// Frequency of the main oscillator (Hz): one tick.
pub const OSCILLATOR_HZ: f64 = 20e6;
/// Cycles by which sleep delays an interrupt. Source: DS40002287, section "Interrupt Response Time".
const WAKE_UP_CYCLES: u64 = 5;

/// An emulated ATtiny412 microcontroller with the peripherals that a cell uses.
///
/// Time counts in ticks of the 20 MHz oscillator (50 ns) from power-on. A step is a whole instruction, so a device that
/// runs until a tick may stop a few cycles after it. The start-up time after a reset is not emulated.
#[derive(Debug, Clone)]
pub struct Device {
    pub(super) core: Core,
    program: Arc<Program>,
    space: Space,
    now: u64,
    asleep: bool,
    /// Interrupt that is executed as soon as the core allows.
    pending: Option<Accepted>,
    /// Tick of the next event that is not caused by an instruction.
    next_event: u64,
}

/// When to stop running.
#[derive(Clone, Copy)]
struct Until {
    tick: u64,
    /// Whether to stop when the I²C client releases the clock.
    released: bool,
}

impl Device {
    /// A device at power-on, with `program` in flash and `eeprom` at the start of its EEPROM (128 bytes; the rest is
    /// erased).
    pub fn new(program: Arc<Program>, eeprom: &[u8]) -> Self {
        let space = Space::new(eeprom);
        Self { core: Core::new(RAM_END), program, space, now: 0, asleep: false, pending: None, next_event: u64::MAX }
    }

    /// The flash of an ATtiny412, starting with `flash`.
    ///
    /// # Errors
    /// [`Refusal`] for more than 4096 bytes.
    pub fn program(flash: &[u8]) -> Result<Arc<Program>, Refusal> {
        Program::new(flash, usize::from(FLASH_LEN)).map(Arc::new)
    }

    /// Present tick.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Instructions executed since power-on.
    pub fn instructions(&self) -> u64 {
        self.core.instructions
    }

    /// Whether the CPU sleeps.
    pub fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// Accesses without effect since power-on. A correct program causes none.
    pub fn faults(&self) -> Faults {
        self.space.faults
    }

    /// DAC code on pin PA6; `None` if the DAC does not drive the pin.
    pub fn dac_output(&self) -> Option<u8> {
        self.space.dac.output()
    }

    /// [`dac_output`](Self::dac_output) at `tick`, which must not be earlier than the last change but one.
    pub(crate) fn dac_output_at(&self, tick: u64) -> Option<u8> {
        self.space.dac.output_at(tick)
    }

    /// Applies a level to the clock line, pin PA3.
    pub fn set_clock(&mut self, high: bool) {
        self.space.clock.set(high);
        self.space.attention = true;
    }

    /// Resets the device, as when its supply has dipped. SRAM and EEPROM are kept; time continues.
    pub fn reset(&mut self) {
        self.space.reset();
        // the general registers are not reset
        let mut core = Core::new(RAM_END);
        core.registers = self.core.registers;
        core.instructions = self.core.instructions;
        self.core = core;
        self.asleep = false;
        self.attend();
    }

    /// Runs until `tick`, or the end of the instruction that reaches it.
    pub fn run_until(&mut self, tick: u64) {
        self.run(Until { tick, released: false }, &mut Silent);
    }

    /// As [`run_until`](Self::run_until), passing every step to `sink`.
    pub fn trace_until(&mut self, tick: u64, sink: impl FnMut(&TraceRecord)) {
        self.run(Until { tick, released: false }, &mut Sink(sink));
    }

    /// Runs until the I²C client does not hold the clock, at most until `tick`; returns whether it does not.
    pub(crate) fn run_until_released(&mut self, tick: u64) -> bool {
        self.run(Until { tick, released: true }, &mut Silent);
        !self.space.twi.holds()
    }

    fn run<O: Observer>(&mut self, until: Until, observer: &mut O) {
        loop {
            if self.space.attention {
                self.attend();
                self.reset_if_requested(observer);
            }
            if self.now >= until.tick || until.released && !self.space.twi.holds() {
                return;
            }
            if self.take_interrupt(observer) {
                continue;
            }
            let limit = until.tick.min(self.next_event);
            if self.asleep {
                self.now = self.now.max(limit);
            } else {
                self.execute(limit, observer);
            }
            if self.now >= self.next_event {
                self.space.attention = true;
            }
        }
    }

    /// Instructions until `limit`, or until something wants to be looked at.
    #[inline]
    fn execute<O: Observer>(&mut self, limit: u64, observer: &mut O) {
        let ticks_per_cycle = self.space.ticks_per_cycle;
        // while an interrupt waits for the I flag or for the end of a hold, each instruction may let it in
        let once = self.pending.is_some();
        loop {
            self.space.now = self.now;
            let before = O::ON.then(|| self.core.clone());
            let step = self.core.step(&self.program, &mut self.space);
            if let Some(before) = before {
                observer.hear(instruction(self.now, &self.program, &before, &self.core));
            }
            self.now += u64::from(step.cycles) * ticks_per_cycle;
            if step.event != Event::None {
                self.handle(step.event);
                return;
            }
            if self.space.attention || once || self.now >= limit {
                return;
            }
        }
    }

    #[inline(never)]
    fn handle(&mut self, event: Event) {
        match event {
            Event::Sleep => {
                self.space.ccp.close();
                self.asleep = self.space.sleeps;
            }
            Event::Reti => {
                self.space.cpuint.leave();
                self.space.attention = true;
            }
            Event::Illegal => {
                let pc = self.program.wrap(self.core.pc.wrapping_sub(1));
                self.space.faults.record(Fault::Illegal { pc });
            }
            // no debugger and no watchdog: no operation
            Event::Break | Event::WatchdogReset | Event::None => {}
        }
    }

    /// Looks at everything that an instruction or an event may have changed.
    #[inline(never)]
    fn attend(&mut self) {
        let space = &mut self.space;
        space.attention = false;
        let wait_cycles = std::mem::take(&mut space.wait_cycles);
        self.now += u64::from(wait_cycles) * space.ticks_per_cycle;
        space.dac.settle(self.now);
        space.advance_timer(self.now);
        space.ccp.advance(self.core.instructions);
        if space.ccp.is_open() {
            // counts instructions, and no interrupt comes in between
            space.attention = true;
            self.pending = None;
        } else {
            self.pending = space.cpuint.next(space.requests());
        }
        self.next_event = space.tca.next_overflow(space.ticks_per_cycle).unwrap_or(u64::MAX);
    }

    fn reset_if_requested<O: Observer>(&mut self, observer: &mut O) {
        if self.space.reset_requested {
            self.reset();
            self.hear(observer, TraceStep::Reset);
        }
    }

    /// Wakes up for, or enters, the pending interrupt if the core lets it; returns whether time has passed.
    fn take_interrupt<O: Observer>(&mut self, observer: &mut O) -> bool {
        let Some(accepted) = self.pending else { return false };
        let ticks_per_cycle = self.space.ticks_per_cycle;
        if self.asleep && self.core.sreg & sreg::I != 0 {
            self.asleep = false;
            self.hear(observer, TraceStep::Wake);
            self.now += WAKE_UP_CYCLES * ticks_per_cycle;
            self.space.attention = true;
            return true;
        }
        if !self.core.interrupts_enabled() {
            return false;
        }
        self.hear(observer, TraceStep::Interrupt { vector: accepted.vector });
        self.space.cpuint.enter(accepted);
        let cycles = self.core.interrupt(accepted.vector, &mut self.space);
        self.now += u64::from(cycles) * ticks_per_cycle;
        self.space.attention = true;
        true
    }

    fn hear<O: Observer>(&self, observer: &mut O, step: TraceStep) {
        if O::ON {
            observer.hear(TraceRecord { tick: self.now, step });
        }
    }
}

/// The bus as the device's I²C client hears it. The caller has run the device up to each moment.
impl Device {
    /// START.
    pub(crate) fn hear_start(&mut self) {
        self.space.twi.hear_start();
    }

    /// The address byte behind a START. A client that is addressed holds the clock.
    pub(crate) fn hear_address(&mut self, byte: u8) {
        self.space.attention = true;
        self.space.twi.hear_address(byte);
    }

    /// A byte of the master.
    pub(crate) fn hear_byte(&mut self, byte: u8) {
        self.space.attention = true;
        self.space.twi.hear_byte(byte);
    }

    /// Byte on its way to the master; ones where the client is silent.
    pub(crate) fn byte_sent(&self) -> u8 {
        self.space.twi.byte_sent()
    }

    /// The master's answer to a byte of clients.
    pub(crate) fn hear_answer(&mut self, on_bus: u8, acknowledged: bool) {
        self.space.attention = true;
        self.space.twi.hear_answer(on_bus, acknowledged);
    }

    /// STOP.
    pub(crate) fn hear_stop(&mut self) {
        self.space.attention = true;
        self.space.twi.hear_stop();
    }

    /// Whether the client holds the clock.
    pub(crate) fn holds_clock(&self) -> bool {
        self.space.twi.holds()
    }

    /// Acknowledge bit that the client gave to the last byte, once.
    pub(crate) fn take_acknowledge(&mut self) -> bool {
        self.space.twi.take_acknowledge()
    }
}

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
    Reset,
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
            TraceStep::Reset => write!(f, "----  reset"),
        }
    }
}

/// Hears what a running device does.
trait Observer {
    /// Whether anything is heard; without, the calls cost nothing.
    const ON: bool;
    /// A step.
    fn hear(&mut self, record: TraceRecord);
}

/// Hears nothing.
struct Silent;

impl Observer for Silent {
    const ON: bool = false;
    fn hear(&mut self, _: TraceRecord) {}
}

/// Passes every step on.
struct Sink<F>(F);

impl<F: FnMut(&TraceRecord)> Observer for Sink<F> {
    const ON: bool = true;
    fn hear(&mut self, record: TraceRecord) {
        (self.0)(&record);
    }
}

/// The instruction that took the core from `before` to `after`.
fn instruction(tick: u64, program: &Program, before: &Core, after: &Core) -> TraceRecord {
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
    TraceRecord { tick, step: TraceStep::Instruction { pc: before.pc, text: disassemble(program, before.pc), changes } }
}
