//! Core with 64 KiB of plain memory around it.

use spts_firmware::avr::{Core, DataSpace, Event, Program, Step};

/// Last byte of SRAM in the ATtiny412.
pub(crate) const RAM_END: u16 = 0x3FFF;

/// Memory at every address.
#[derive(Clone)]
pub(crate) struct Memory(Box<[u8; 0x1_0000]>);

impl Memory {
    pub(crate) fn byte(&self, address: u16) -> u8 {
        self.0[usize::from(address)]
    }

    pub(crate) fn bytes(&self, range: std::ops::RangeInclusive<u16>) -> &[u8] {
        &self.0[usize::from(*range.start())..=usize::from(*range.end())]
    }
}

impl DataSpace for Memory {
    fn read(&mut self, address: u16) -> u8 {
        assert!(!(0x3D..=0x3F).contains(&address), "the core serves {address:#x} itself");
        self.byte(address)
    }

    fn write(&mut self, address: u16, value: u8) {
        assert!(!(0x3D..=0x3F).contains(&address), "the core serves {address:#x} itself");
        self.0[usize::from(address)] = value;
    }
}

/// Core, program and memory.
#[derive(Clone)]
pub(crate) struct Machine {
    pub(crate) core: Core,
    pub(crate) program: Program,
    pub(crate) memory: Memory,
}

impl Machine {
    pub(crate) fn new(words: &[u16]) -> Self {
        Self { core: Core::new(RAM_END), program: Program::from_words(words), memory: Memory(Box::new([0; 0x1_0000])) }
    }

    /// Sets registers.
    pub(crate) fn with(mut self, registers: &[(usize, u8)]) -> Self {
        for (k, value) in registers {
            self.core.registers[*k] = *value;
        }
        self
    }

    pub(crate) fn with_sreg(mut self, sreg: u8) -> Self {
        self.core.sreg = sreg;
        self
    }

    /// Sets bytes of the data space.
    pub(crate) fn with_memory(mut self, address: u16, bytes: &[u8]) -> Self {
        for (k, byte) in (0..).zip(bytes) {
            self.memory.write(address.wrapping_add(k), *byte);
        }
        self
    }

    pub(crate) fn step(&mut self) -> Step {
        self.core.step(&self.program, &mut self.memory)
    }

    /// Executes `count` instructions, none of which has an event; returns the cycles.
    pub(crate) fn run(&mut self, count: usize) -> u32 {
        (0..count)
            .map(|_| {
                let step = self.step();
                assert_eq!(step.event, Event::None, "at {:#x}", self.core.pc);
                step.cycles
            })
            .sum()
    }

    /// The machine after `count` instructions.
    pub(crate) fn after(mut self, count: usize) -> Self {
        self.run(count);
        self
    }

    pub(crate) fn register(&self, k: usize) -> u8 {
        self.core.registers[k]
    }

    /// Registers `low + 1`:`low`.
    pub(crate) fn pair(&self, low: usize) -> u16 {
        u16::from_le_bytes([self.core.registers[low], self.core.registers[low + 1]])
    }
}
