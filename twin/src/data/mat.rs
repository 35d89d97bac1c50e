//! Variables of a MATLAB v5 file, which MATLAB's `save` writes with `-v6` or `-v7`. Its elements are decompressed and
//! found first, so that nothing is converted that would not fit.

use flate2::read::ZlibDecoder;
use spts_input::Refusal;
use std::io::Read as _;
use std::path::Path;

/// A numeric array: its name, `shape` and column-major `values`.
#[derive(Debug, Clone, PartialEq)]
pub struct MatVariable {
    /// Name.
    pub name: String,
    /// Size along each dimension.
    pub shape: Vec<usize>,
    /// Values, first index fastest.
    pub values: Vec<f64>,
}

/// Largest file taken for a recording, bytes: the published ones are below 4 MB.
const MAX_FILE_BYTES: u64 = 1 << 28;
/// Most values of an array: 16 times the longest published recording. Whatever their type in the file, each takes
/// 8 bytes here, several times over.
const MAX_VALUES: usize = 1 << 25;

/// Reads the first of the variables `names` that the file at `path` has.
///
/// # Errors
/// [`Refusal`] when the file cannot be read, is not MATLAB v5, or that variable is missing or no array of numbers.
pub(super) fn read_mat(path: &Path, names: &[&str]) -> Result<MatVariable, Refusal> {
    let bytes = spts_input::read(path, MAX_FILE_BYTES).map_err(Refusal::in_file(path))?;
    parse_mat(bytes, names, path)
}

/// Reads the first of the variables `names` from the content `bytes` of a MATLAB v5 file. Errors name the file `path`.
///
/// # Errors
/// [`Refusal`] when they are not MATLAB v5, or that variable is missing or no array of numbers.
pub fn parse_mat(bytes: Vec<u8>, names: &[&str], path: &Path) -> Result<MatVariable, Refusal> {
    let wanted = names.first().copied().unwrap_or_default();
    let plain = unpacked(bytes, wanted, path)?;
    let found = mat_elements(&plain[HEADER..]);
    let element = names.iter().find_map(|name| found.iter().find(|element| element.name == *name));
    array(element.ok_or_else(|| missing(wanted, &found, path))?, path)
}

/// Reads an array and the first of the variables `times` from the file at `path`. The array is the one called
/// `variable`; without a name it is the first of `usual`, or the only one with at least `least` values.
///
/// # Errors
/// As for [`parse_mat`].
pub(super) fn read_mat_array(
    path: &Path,
    variable: Option<&str>,
    usual: &[&str],
    times: &[&str],
    least: usize,
) -> Result<(MatVariable, Option<MatVariable>), Refusal> {
    let bytes = spts_input::read(path, MAX_FILE_BYTES).map_err(Refusal::in_file(path))?;
    let wanted = variable.or(usual.first().copied()).unwrap_or_default();
    let plain = unpacked(bytes, wanted, path)?;
    let found = mat_elements(&plain[HEADER..]);
    let named = |name: &str| found.iter().find(|element| element.name == name);
    let large =
        |element: &&MatElement<'_>| element.numbers.is_some_and(|(kind, data)| data.len() / width(kind) >= least);
    let only = || {
        let mut large = found.iter().filter(large);
        large.next().filter(|_| large.next().is_none())
    };
    let element = match variable {
        Some(name) => named(name),
        None => usual.iter().find_map(|name| named(name)).or_else(only),
    };
    let array_of = array(element.ok_or_else(|| missing(wanted, &found, path))?, path)?;
    let times = times.iter().filter(|name| **name != array_of.name).find_map(|name| named(name));
    Ok((array_of, times.map(|element| array(element, path)).transpose()?))
}

/// The elements of the file `bytes`, without compression. `wanted` is the variable that an error speaks of.
fn unpacked(bytes: Vec<u8>, wanted: &str, path: &Path) -> Result<Vec<u8>, Refusal> {
    if let Some(format) = other_format(&bytes) {
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let problem =
            format!("{format}; MATLAB v5 is read: load it in MATLAB or Octave, then save('{file}', '{wanted}', '-v7')");
        return Err(Refusal::new(problem).at(path.display()));
    }
    inflate(&bytes).map_err(|reason| not_mat(path, &reason))
}

fn missing(wanted: &str, found: &[MatElement<'_>], path: &Path) -> Refusal {
    Refusal::new(format!("no variable `{wanted}` (found: {})", listed(found))).at(path.display())
}

/// The numbers of `element`.
fn array(element: &MatElement<'_>, path: &Path) -> Result<MatVariable, Refusal> {
    let refused = |problem: String| Refusal::new(problem).at(path.display());
    let not_mat = |reason: String| not_mat(path, &reason);
    let name = element.name.clone();
    let Some((kind, data)) = element.numbers else {
        let class = element.class;
        return Err(refused(format!("variable `{name}` is a {class}; expected an array of numbers")));
    };
    if element.complex {
        return Err(refused(format!("variable `{name}` is complex; expected real numbers, such as real({name})")));
    }
    let count = data.len() / width(kind);
    if count > MAX_VALUES {
        return Err(not_mat(format!("`{name}` holds {count} values, outside [0, {MAX_VALUES}]")));
    }
    let values = values(kind, data).ok_or_else(|| not_mat(format!("`{name}` is damaged")))?;
    let shape = element.shape.clone();
    let expected = shape.iter().try_fold(1_usize, |n, &d| n.checked_mul(d));
    if expected != Some(values.len()) {
        return Err(not_mat(format!("`{name}` holds {} values for shape {shape:?}", values.len())));
    }
    Ok(MatVariable { name, shape, values })
}

/// The error of a file that is not in MATLAB v5 format, or is damaged.
pub(super) fn not_mat(path: &Path, reason: &str) -> Refusal {
    Refusal::new(format!("{}: not a readable MATLAB v5 file ({reason})", path.display()))
}

/// What the file is, if it is of another format that MATLAB or Octave write.
///
/// Sources: MathWorks, *MAT-File Format*. In "Level 5", the last two bytes of the header tell the byte order. A file of
/// "Level 4" has no header of text. It begins with the number 1000 M + 10 P + T: M is the byte order, P ≤ 5 the type,
/// and T ≤ 2 the kind of the matrix. HDF5 File Format Specification, II.A: the signature stands at byte 0, 512, 1024,
/// 2048, and so on.
fn other_format(file: &[u8]) -> Option<&'static str> {
    let hdf5 = |at: usize| file.get(at..).is_some_and(|rest| rest.starts_with(b"\x89HDF\r\n\x1a\n"));
    if hdf5(0) || (9..20).any(|k| hdf5(1 << k)) || file.starts_with(b"MATLAB 7.3") {
        return Some("a MATLAB v7.3 file (HDF5)");
    }
    if file.get(126..128) == Some(b"MI") {
        return Some("a big-endian MATLAB v5 file");
    }
    if file.starts_with(b"# Created by Octave") || file.starts_with(b"Octave-1") {
        return Some("a file in a format of Octave's own");
    }
    let first: [u8; 4] = file.get(..4)?.try_into().ok()?;
    let is_v4 = |word: u32| word / 1000 <= 4 && word % 1000 / 100 == 0 && word % 100 / 10 <= 5 && word % 10 <= 2;
    let has_header = file.get(126..128) == Some(b"IM");
    let is_v4 = is_v4(u32::from_le_bytes(first)) || is_v4(u32::from_be_bytes(first));
    (is_v4 && !has_header).then_some("a MATLAB v4 file")
}

/// Names and classes of the variables, as an error lists them.
fn listed(found: &[MatElement<'_>]) -> String {
    const MOST: usize = 10;
    if found.is_empty() {
        return "no variable".to_owned();
    }
    let names = found.iter().take(MOST).map(|e| format!("{} ({})", e.name, e.class));
    let names: Vec<String> = names.collect();
    let more = found.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    names.join(", ") + &more
}

/// Length of the file header, bytes.
const HEADER: usize = 128;
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
fn inflate(file: &[u8]) -> Result<Vec<u8>, String> {
    let header = file
        .get(..HEADER)
        .ok_or_else(|| format!("the file ends after {} bytes; its header alone has {HEADER}", file.len()))?;
    if header[126..] != *b"IM" {
        return Err("it does not begin with the header of one".to_owned());
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
                return Err(format!("the element at byte {at} unfolds to more than {MAX_BYTES} bytes"));
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

/// Type of an element that is a matrix, `miMATRIX`.
const MATRIX: u32 = 14;
/// Length of the tag of an element, bytes.
const TAG: usize = 8;

/// A variable of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
struct MatElement<'a> {
    name: String,
    /// Class, in MATLAB's words.
    class: &'static str,
    /// Size along each dimension.
    shape: Vec<usize>,
    /// Type and bytes of the real parts; `None` if it is no array of numbers.
    numbers: Option<(u32, &'a [u8])>,
    /// Whether it has imaginary parts too.
    complex: bool,
}

/// The variables that stand in `elements`, which is what follows a file's header, without compression. What is damaged
/// ends the list, or has no values.
///
/// Layout: MathWorks, *MAT-File Format*, chapter "Level 5 MAT-File Format".
fn mat_elements(elements: &[u8]) -> Vec<MatElement<'_>> {
    let mut found = Vec::new();
    let mut rest = elements;
    while let Some((kind, body)) = rest.get(..TAG).and_then(|tag| {
        let length = usize::try_from(word(tag, 4)?).ok()?;
        Some((word(tag, 0)?, rest.get(..TAG.checked_add(length)?)?))
    }) {
        if kind == MATRIX {
            found.extend(matrix(body));
        }
        let padded = body.len().next_multiple_of(TAG).min(rest.len());
        rest = &rest[padded..];
    }
    found
}

/// The matrix whose element is `bytes`.
fn matrix(bytes: &[u8]) -> Option<MatElement<'_>> {
    let mut rest = bytes.get(TAG..)?;
    let (_, flags) = part(&mut rest)?;
    let (class, numeric) = class(*flags.first()?);
    // the byte above the class holds the flags: complex, global, logical
    let complex = flags.get(1)? & 8 != 0;
    let (_, dimensions) = part(&mut rest)?;
    let (_, name) = part(&mut rest)?;
    let (sides, _) = dimensions.as_chunks::<4>();
    Some(MatElement {
        name: String::from_utf8_lossy(name).into_owned(),
        class,
        shape: sides.iter().map(|side| u32::from_le_bytes(*side) as usize).collect(),
        // with other classes the parts are elements of their own, which nothing reads
        numbers: numeric.then(|| part(&mut rest).unwrap_or_default()),
        complex,
    })
}

/// The type and data of the part that `rest` begins with; leaves what follows it.
fn part<'a>(rest: &mut &'a [u8]) -> Option<(u32, &'a [u8])> {
    let first = word(rest, 0)?;
    let small = first >> 16;
    let (kind, data, whole) = if small != 0 {
        // at most four bytes in place of the length
        let length = usize::try_from(small).ok().filter(|length| *length <= 4)?;
        (first & 0xffff, rest.get(4..4 + length)?, TAG)
    } else {
        let length = usize::try_from(word(rest, 4)?).ok()?;
        let end = TAG.checked_add(length)?;
        (first, rest.get(TAG..end)?, end.next_multiple_of(TAG))
    };
    *rest = &rest[whole.min(rest.len())..];
    Some((kind, data))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
}

/// Bytes a value of the type `kind`; one for types that are not known.
fn width(kind: u32) -> usize {
    match kind {
        3 | 4 => 2,
        5..=7 => 4,
        9 | 12 | 13 => 8,
        _ => 1,
    }
}

/// The numbers of the type `kind` in `data`, which need not be that of their class. `None` for a type of no numbers.
fn values(kind: u32, data: &[u8]) -> Option<Vec<f64>> {
    fn all<const N: usize>(data: &[u8], value: impl Fn([u8; N]) -> f64) -> Option<Vec<f64>> {
        let (chunks, rest) = data.as_chunks::<N>();
        rest.is_empty().then(|| chunks.iter().map(|chunk| value(*chunk)).collect())
    }
    match kind {
        1 => all(data, |b| i8::from_le_bytes(b).into()),
        2 => all(data, |b| u8::from_le_bytes(b).into()),
        3 => all(data, |b| i16::from_le_bytes(b).into()),
        4 => all(data, |b| u16::from_le_bytes(b).into()),
        5 => all(data, |b| i32::from_le_bytes(b).into()),
        6 => all(data, |b| u32::from_le_bytes(b).into()),
        7 => all(data, |b| f32::from_le_bytes(b).into()),
        9 => all(data, f64::from_le_bytes),
        12 => all(data, |b| i64::from_le_bytes(b) as f64),
        13 => all(data, |b| u64::from_le_bytes(b) as f64),
        _ => None,
    }
}

/// Name of the class, and whether it is an array of numbers.
fn class(number: u8) -> (&'static str, bool) {
    match number {
        1 => ("cell", false),
        2 => ("struct", false),
        3 | 17 => ("object", false),
        4 => ("char", false),
        5 => ("sparse", false),
        6 => ("double", true),
        7 => ("single", true),
        8 => ("int8", true),
        9 => ("uint8", true),
        10 => ("int16", true),
        11 => ("uint16", true),
        12 => ("int32", true),
        13 => ("uint32", true),
        14 => ("int64", true),
        15 => ("uint64", true),
        16 => ("function", false),
        _ => ("unknown", false),
    }
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
        let compressed = [&header[..], &element, &COMPRESSED.to_le_bytes(), &length.to_le_bytes(), &packed].concat();
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
