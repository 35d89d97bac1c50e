//! What the master of the I²C bus sends and gets.

/// A transaction that failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BusError {
    /// No cell answers to the address.
    #[error("no cell acknowledges address {address}")]
    NoAcknowledge {
        /// Address on the bus.
        address: u8,
    },
    /// An address with more than seven bits. Nothing was sent.
    #[error("bus address {address} is outside [0, 127]")]
    Address {
        /// Address asked for.
        address: u8,
    },
    /// A byte broken off behind no bit, or behind all of them. Nothing was sent.
    #[error("`bits` = {bits} of a byte that is broken off is outside [1, 7]")]
    Bits {
        /// Number asked for.
        bits: u8,
    },
    /// The cell did not take a byte.
    #[error("the cell at address {address} refuses byte {index} of the write")]
    Refused {
        /// Address on the bus.
        address: u8,
        /// Place of the byte in the write, from 0.
        index: usize,
    },
    /// A cell holds the clock low. The bus is dead until that cell is reset.
    #[error("the cell at address {address} has held the bus clock low for 25 ms")]
    Stuck {
        /// Address that the cell was given.
        address: u8,
    },
}

/// What a master can do on the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusEvent {
    /// START, or repeated START within a transaction.
    Start,
    /// A byte from the master. The first one behind a START is an address (upper seven bits) and a direction (1 =
    /// read).
    Write(u8),
    /// A byte to the master, which it acknowledges or not.
    Read {
        /// Whether the master asks for another byte.
        acknowledge: bool,
    },
    /// The first bits, 1 to 7, of a byte that is broken off. Until the next START or STOP no byte reaches a cell.
    Bits(u8),
    /// STOP.
    Stop,
}

/// What the master saw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusReply {
    /// Whether a byte from the master was acknowledged.
    Acknowledged(bool),
    /// A byte to the master; 255 if nobody sends.
    Byte(u8),
}

/// Where a transaction stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Stage {
    /// Whole bytes.
    #[default]
    Bytes,
    /// A START without its address yet.
    Started,
    /// Within a byte.
    Broken,
}
