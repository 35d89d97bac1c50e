//! The compressed elements of a MATLAB v5 file.

use flate2::read::ZlibDecoder;
use std::io::Read as _;

/// Length of the file header, bytes.
pub(super) const HEADER: usize = 128;
/// Type of a compressed element, `miCOMPRESSED`.
const COMPRESSED: u32 = 15;
/// Most bytes a file may unfold to: a recording of 250 presses as doubles.
const MAX_BYTES: usize = 1 << 28;

/// The same file without compression, so that every element's length is known before it is parsed.
///
/// Layout: a header of 128 bytes that ends in a version and "IM" (little-endian), then elements, each a type and a
/// length (32 bits both) and that many bytes. Source: MathWorks, *MAT-File Format*, chapter "Level 5 MAT-File Format".
///
/// # Errors
/// What is wrong, in words: a foreign header, a file that ends early, a damaged element.
pub(super) fn inflate(file: &[u8]) -> Result<Vec<u8>, String> {
    let header = file.get(..HEADER).ok_or_else(|| {
        format!(
            "the file ends after {} bytes; its header alone has {HEADER}",
            file.len()
        )
    })?;
    if header[126..] != *b"IM" {
        return Err("it does not begin with a little-endian v5 header".to_owned());
    }
    let mut plain = header.to_vec();
    let mut rest = &file[HEADER..];
    while !rest.is_empty() {
        let at = file.len() - rest.len();
        let ends = |needed: usize| {
            format!(
                "the file ends after {} bytes; the element at byte {at} needs {needed} more than there are",
                file.len()
            )
        };
        let (head, body) = rest.split_at_checked(8).ok_or_else(|| ends(8 - rest.len()))?;
        let word = |i: usize| u32::from_le_bytes([head[i], head[i + 1], head[i + 2], head[i + 3]]);
        let length = usize::try_from(word(4)).map_err(|_| "an element is too long".to_owned())?;
        let (element, after) = body.split_at_checked(length).ok_or_else(|| ends(length - body.len()))?;
        if word(0) == COMPRESSED {
            let limit = (MAX_BYTES - plain.len().min(MAX_BYTES)) as u64;
            let before = plain.len();
            let read = ZlibDecoder::new(element).take(limit).read_to_end(&mut plain);
            read.map_err(|e| format!("the compressed element at byte {at} is damaged: {e}"))?;
            if (plain.len() - before) as u64 == limit {
                return Err(format!(
                    "the element at byte {at} unfolds to more than {MAX_BYTES} bytes"
                ));
            }
        } else {
            if plain.len() + head.len() + element.len() > MAX_BYTES {
                return Err(format!("it unfolds to more than {MAX_BYTES} bytes"));
            }
            plain.extend_from_slice(head);
            plain.extend_from_slice(element);
        }
        rest = after;
    }
    Ok(plain)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::ZlibEncoder;
    use std::io::Write as _;

    /// A header, an element as it is, and the same element compressed.
    fn file() -> (Vec<u8>, Vec<u8>) {
        let mut header = vec![b' '; HEADER];
        header[124..].copy_from_slice(&[0, 1, b'I', b'M']);
        let element = [&14_u32.to_le_bytes()[..], &16_u32.to_le_bytes(), &[7; 16]].concat();
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&element).unwrap();
        let packed = encoder.finish().unwrap();
        let length = u32::try_from(packed.len()).unwrap();
        let compressed = [
            &header[..],
            &element,
            &COMPRESSED.to_le_bytes(),
            &length.to_le_bytes(),
            &packed,
        ]
        .concat();
        (compressed, [header, element.clone(), element].concat())
    }

    #[test]
    fn a_compressed_element_unfolds_to_what_it_was() {
        let (compressed, plain) = file();
        assert_eq!(inflate(&compressed).unwrap(), plain);
        assert_eq!(inflate(&plain).unwrap(), plain);
    }

    #[test]
    fn every_cut_is_named_and_no_flipped_byte_panics() {
        let (compressed, _) = file();
        let boundaries = [HEADER, HEADER + 24, compressed.len()];
        for length in (0..compressed.len()).filter(|l| !boundaries.contains(l)) {
            let said = inflate(&compressed[..length]).unwrap_err();
            assert!(said.contains(&format!("ends after {length} bytes")), "{length}: {said}");
        }
        let packed = HEADER + 24 + 8;
        for at in 0..compressed.len() {
            let mut damaged = compressed.clone();
            damaged[at] ^= 0x55;
            let found = inflate(&damaged);
            // the stream carries a checksum; what stands outside it is for the parser to judge
            assert!(at < packed || found.is_err(), "byte {at} of {}", compressed.len());
        }
    }
}
