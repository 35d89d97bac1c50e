//! Accesses that neither the emulation nor the device responds to.

/// Something that the firmware does and the emulation does not support; it has no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// Read of an address that does not exist or whose peripheral is not emulated. Returns 0.
    Read {
        /// Data address.
        address: u16,
    },
    /// Write to such an address. Ignored.
    Write {
        /// Data address.
        address: u16,
        /// Byte written.
        value: u8,
    },
    /// Write to a protected register outside its time window. Ignored.
    Protected {
        /// Data address.
        address: u16,
    },
    /// An unsupported setting of an emulated register. Ignored.
    Unsupported {
        /// Data address.
        address: u16,
        /// Byte written.
        value: u8,
    },
    /// An opcode that the core does not have. Executed as no operation.
    Illegal {
        /// Word address.
        pc: u16,
    },
}

/// First fault, and the number of faults since power-on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Faults {
    first: Option<Fault>,
    count: u64,
}

impl Faults {
    /// First fault.
    #[must_use]
    pub fn first(&self) -> Option<Fault> {
        self.first
    }

    /// Number of faults.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn record(&mut self, fault: Fault) {
        self.first.get_or_insert(fault);
        self.count += 1;
    }
}
