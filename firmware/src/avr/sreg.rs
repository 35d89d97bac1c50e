//! Bits of the status register.

/// Carry.
pub const C: u8 = 1 << 0;
/// Zero.
pub const Z: u8 = 1 << 1;
/// Negative.
pub const N: u8 = 1 << 2;
/// Two's complement overflow.
pub const V: u8 = 1 << 3;
/// Sign, N ⊕ V.
pub const S: u8 = 1 << 4;
/// Half carry.
pub const H: u8 = 1 << 5;
/// Bit copy storage.
pub const T: u8 = 1 << 6;
/// Global interrupt enable.
pub const I: u8 = 1 << 7;
