//! The elements of a MATLAB v5 file, found before anything is decompressed.

/// Type of an element that is a matrix, `miMATRIX`.
const MATRIX: u32 = 14;
/// Length of the tag of an element, bytes.
const TAG: usize = 8;

/// A variable of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MatElement<'a> {
    pub(super) name: String,
    /// Class, in MATLAB's words.
    pub(super) class: &'static str,
    /// Whether it is an array of numbers.
    pub(super) numeric: bool,
    /// Number of stored values, real and imaginary.
    pub(super) values: usize,
    /// The whole element, its tag included.
    pub(super) bytes: &'a [u8],
}

/// The variables that stand in `elements`, which is what follows a file's header, without compression. What is damaged
/// is left to the parser: it ends the list, or has the values that there could be at most.
///
/// Layout: MathWorks, *MAT-File Format*, chapter "Level 5 MAT-File Format".
pub(super) fn mat_elements(elements: &[u8]) -> Vec<MatElement<'_>> {
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
    let (_, _dimensions) = part(&mut rest)?;
    let (_, name) = part(&mut rest)?;
    let mut values = 0;
    // with other classes the parts are elements of their own, which nothing reads
    while numeric && let Some((kind, data)) = part(&mut rest) {
        values += data.len() / width(kind);
    }
    Some(MatElement {
        name: String::from_utf8_lossy(name).into_owned(),
        class,
        numeric,
        values,
        bytes,
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
