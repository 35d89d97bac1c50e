//! Reads the header of a NumPy array from an untrusted file.

use npyz::NpyHeader;
use std::io::{self, Read};

/// First bytes of every array.
const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Longest header that is parsed, bytes: type, order and a few sides, padded. The parser makes room for whatever length
/// a file states, and descends into every bracket of it.
const MAX_HEADER: usize = 1 << 10;
/// Brackets within each other in a header that is parsed: a dictionary with a tuple of sides has two, one with a record
/// type four. The parser's time doubles with every one.
const MAX_DEPTH: usize = 6;

/// Most brackets of `text` within each other.
fn deepest(text: &[u8]) -> usize {
    let (mut depth, mut most) = (0_usize, 0);
    for byte in text {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        most = most.max(depth);
    }
    most
}

/// Reads the header at the start of `reader`, and the sides of the array. `reader` is left at the first value.
///
/// # Errors
/// [`io::Error`]: `InvalidData` with the cause for a header that is not valid, or the error of the reader.
pub fn read_npy_header(reader: &mut impl Read) -> io::Result<(NpyHeader, Vec<usize>)> {
    let invalid = |reason: String| io::Error::new(io::ErrorKind::InvalidData, reason);
    let mut start = [0; 10];
    reader.read_exact(&mut start).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => invalid("it ends before the header does".to_owned()),
        _ => error,
    })?;
    if start[..6] != *MAGIC {
        return Err(invalid("it does not begin with \\x93NUMPY".to_owned()));
    }
    let mut whole = start.to_vec();
    let length = match start[6] {
        1 => usize::from(u16::from_le_bytes([start[8], start[9]])),
        2 | 3 => {
            let mut more = [0; 2];
            reader.read_exact(&mut more)?;
            whole.extend(more);
            u32::from_le_bytes([start[8], start[9], more[0], more[1]]) as usize
        }
        other => return Err(invalid(format!("version = {other} is outside [1, 3]"))),
    };
    if length > MAX_HEADER {
        return Err(invalid(format!(
            "header length = {length} bytes is outside [0, {MAX_HEADER}]"
        )));
    }
    let at = whole.len();
    whole.resize(at + length, 0);
    reader.read_exact(&mut whole[at..])?;
    let depth = deepest(&whole[at..]);
    if depth > MAX_DEPTH {
        return Err(invalid(format!("brackets {depth} deep are outside [0, {MAX_DEPTH}]")));
    }
    countable(&whole[at..]).map_err(invalid)?;
    let header = NpyHeader::from_reader(whole.as_slice())?;
    let sides = header.shape().iter().map(|&side| usize::try_from(side));
    let sides: Result<Vec<usize>, _> = sides.collect();
    let sides = sides.map_err(|_| invalid(format!("shape {:?} is too large", header.shape())))?;
    Ok((header, sides))
}

/// Refuses a header whose numbers cannot be multiplied: the parser multiplies the sides without looking.
fn countable(text: &[u8]) -> Result<(), String> {
    let word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let numbers = text
        .split(|byte| !word(byte))
        .filter(|w| w.first().is_some_and(u8::is_ascii_digit));
    numbers
        .map(|number| std::str::from_utf8(number).ok()?.parse::<u64>().ok())
        .try_fold(1_u64, |product, number| product.checked_mul(number?.max(1)))
        .map(|_| ())
        .ok_or_else(|| "the shape is too large".to_owned())
}

/// Number of values of an array with these sides.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] for more values than can be counted.
pub fn npy_values(sides: &[usize]) -> io::Result<usize> {
    let values = sides.iter().try_fold(1_usize, |n, &side| n.checked_mul(side));
    values.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, format!("shape {sides:?} is too large")))
}

/// An empty vector with capacity for `values` values.
///
/// # Errors
/// [`io::ErrorKind::OutOfMemory`] if the memory cannot be reserved.
pub fn room<T>(values: usize) -> io::Result<Vec<T>> {
    let mut room = Vec::new();
    room.try_reserve_exact(values).map_err(|_| {
        let reason = format!("not enough memory for {values} values of {} bytes", size_of::<T>());
        io::Error::new(io::ErrorKind::OutOfMemory, reason)
    })?;
    Ok(room)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(bytes: &[u8]) -> String {
        read_npy_header(&mut &*bytes).map(drop).unwrap_err().to_string()
    }

    #[test]
    fn a_header_is_measured_before_room_is_made_for_it() {
        assert!(said(b"\x93NUMPY\x02\0\xff\xff\xff\xff").contains("header length = 4294967295 bytes"));
        assert!(said(b"\x93NUMPY\x01\0\xff\xff").contains("outside [0, 1024]"));
        assert!(said(b"\x93NUMPY\x07\0\xff\xff").contains("version = 7"));
        assert!(said(b"PK").contains("ends before"));
    }

    /// Brackets in brackets and sides that no machine can count are errors like others.
    #[test]
    fn nested_and_endless_headers_are_refused() {
        let whole = |text: &str| {
            let length = u16::try_from(text.len()).unwrap().to_le_bytes();
            [&b"\x93NUMPY\x01\0"[..], &length, text.as_bytes()].concat()
        };
        for text in [
            "(".repeat(MAX_HEADER),
            "[".repeat(MAX_HEADER),
            "{'descr':".repeat(MAX_HEADER / 9),
            "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 2), }\n".to_owned(),
        ] {
            let _ = said(&whole(&text));
        }
        let huge = "{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999, 9999999999999), }\n";
        assert!(said(&whole(huge)).contains("shape is too large"));
        let hexadecimal = huge.replace("9999999999999", "0xffffffffffff");
        assert!(said(&whole(&hexadecimal)).contains("shape is too large"));
        assert!(npy_values(&[usize::MAX, 2]).is_err());
        let record = "{'descr': [('a', '<f8', (2,)), ('b', '<f8')], 'fortran_order': False, 'shape': (3,), }\n";
        assert_eq!(read_npy_header(&mut whole(record).as_slice()).unwrap().1, [3]);
    }
}
