//! Events and replies on the I²C bus.

/// Why a transaction failed.
///
/// ```
/// use spts_firmware::{Array, Image};
///
/// let mut array = Array::new(2, &Image::shipped())?; // addresses 8 and 9
/// let error = array.write(10, &[2, 8]).unwrap_err();
/// assert_eq!(error.to_string(), "no cell acknowledges address 10");
/// # Ok::<(), spts_firmware::ArrayError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BusError {
    /// No cell acknowledges the address.
    #[error("no cell acknowledges address {address}")]
    NoAcknowledge {
        /// Address on the bus.
        address: u8,
    },
    /// An address of more than seven bits. Nothing was sent.
    #[error("bus address {address} is outside [0, 127]")]
    Address {
        /// The address.
        address: u8,
    },
    /// An incomplete byte of no bit, or of all bits. Nothing was sent.
    #[error("`bits` = {bits} of an incomplete byte is outside [1, 7]")]
    Bits {
        /// The number of bits.
        bits: u8,
    },
    /// The cell did not acknowledge a byte.
    #[error("the cell at address {address} refuses byte {index} of the write")]
    Refused {
        /// Address on the bus.
        address: u8,
        /// Position of the byte in the write, from 0.
        index: usize,
    },
    /// A cell holds the clock low. The bus is blocked until that cell is reset.
    #[error("the cell at address {address} has held the bus clock low for 25 ms")]
    Stuck {
        /// Address of the cell.
        address: u8,
    },
}

/// An event that a bus master can cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusEvent {
    /// START, or repeated START within a transaction.
    Start,
    /// A byte from the master. The first byte after a START holds an address (upper seven bits) and a direction (1 =
    /// read).
    Write(u8),
    /// A byte to the master, which acknowledges it or not.
    Read {
        /// Whether the master asks for another byte.
        acknowledge: bool,
    },
    /// The first bits, 1 to 7, of an incomplete byte. Until the next START or STOP no byte reaches a cell.
    Bits(u8),
    /// STOP.
    Stop,
}

/// What the master received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusReply {
    /// Whether a byte from the master was acknowledged.
    Acknowledged(bool),
    /// A byte to the master; 255 if no cell sends.
    Byte(u8),
}

/// Where a transaction stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Stage {
    /// Whole bytes.
    #[default]
    Bytes,
    /// A START whose address has not come yet.
    Started,
    /// Within an incomplete byte.
    Broken,
}
