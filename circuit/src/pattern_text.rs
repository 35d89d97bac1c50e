//! Patterns as text.

use crate::patterns::Patterns;
use crate::weights_error::WeightsError;
use std::fmt::Write as _;

/// Size of the largest file of patterns that is read, bytes.
pub const MAX_PATTERNS_BYTES: u64 = 1 << 26;
/// Characters of a wrong word that an error repeats.
const SHOWN: usize = 20;

/// Why a text is not a valid pattern.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PatternTextError {
    /// A word that is neither signs nor a code.
    #[error("line {line}: `{word}` is neither a row of + and − signs nor one of the codes in [0, 255]")]
    Word {
        /// Line, from 1.
        line: usize,
        /// The word, shortened.
        word: String,
    },
    /// A row whose length differs from that of the rows before it.
    #[error("line {line}: a row of {found} taxels; the rows before it have {taxels}")]
    Length {
        /// Line, from 1.
        line: usize,
        /// Number of taxels in the row.
        found: usize,
        /// Number of taxels in the first row.
        taxels: usize,
    },
    /// No row, or too many rows.
    #[error(transparent)]
    Patterns(#[from] WeightsError),
}

/// Reads a pattern: one line for each row of the sensing matrix, in order of output. A row has one sign for each taxel
/// (`+` is code 255, level +1; `−` is code 0, level −1), or codes in [0, 255] separated by spaces or commas. The
/// keyboard's hyphen also counts as `−`. A `#` starts a comment.
///
/// ```
/// use spts_circuit::parse_patterns;
///
/// let patterns = parse_patterns("# two rows, three taxels\n+-+\n0 255 128\n")?;
/// assert_eq!((patterns.row(0), patterns.row(1)), (&[255, 0, 255][..], &[0, 255, 128][..]));
/// assert!(parse_patterns("+-\n+").is_err());
/// # Ok::<(), spts_circuit::PatternTextError>(())
/// ```
///
/// # Errors
/// [`PatternTextError`] for the first word that is neither, rows of different lengths, or a text without rows.
pub fn parse_patterns(text: &str) -> Result<Patterns, PatternTextError> {
    let (mut codes, mut rows, mut taxels) = (Vec::new(), 0, None);
    for (index, line) in text.lines().enumerate() {
        let before = codes.len();
        for word in line.split('#').next().unwrap_or_default().split([',', ' ', '\t', '\r']) {
            if word.is_empty() {
                continue;
            }
            if let Some(signs) = signs(word) {
                codes.extend(signs);
                continue;
            }
            let code = word.parse().map_err(|_| PatternTextError::Word {
                line: index + 1,
                word: word.chars().take(SHOWN).collect(),
            })?;
            codes.push(code);
        }
        let found = codes.len() - before;
        if found == 0 {
            continue;
        }
        rows += 1;
        let first = *taxels.get_or_insert(found);
        if found != first {
            return Err(PatternTextError::Length {
                line: index + 1,
                found,
                taxels: first,
            });
        }
    }
    Ok(Patterns::new(rows, codes)?)
}

/// Codes of a word of signs.
fn signs(word: &str) -> Option<Vec<u8>> {
    let code = |c| match c {
        '+' => Some(255),
        '-' | '−' => Some(0),
        _ => None,
    };
    word.chars().map(code).collect()
}

impl Patterns {
    /// The pattern as text for [`parse_patterns`]: signs if all codes are 0 or 255, otherwise codes.
    #[must_use]
    pub fn to_text(&self) -> String {
        let rows = (0..self.period() as u64).map(|row| self.row(row));
        let binary = rows.clone().flatten().all(|code| matches!(code, 0 | 255));
        let mut out = String::new();
        for row in rows {
            for (taxel, code) in row.iter().enumerate() {
                if binary {
                    out.push(if *code == 0 { '-' } else { '+' });
                } else {
                    // a String takes everything
                    let _ = write!(out, "{}{code}", if taxel == 0 { "" } else { " " });
                }
            }
            out.push('\n');
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_back() {
        for codes in [vec![0, 255, 255, 255, 0, 0], vec![0, 1, 2, 128, 254, 255]] {
            for period in [1, 2, 3] {
                let patterns = Patterns::new(period, codes.clone()).unwrap();
                assert_eq!(parse_patterns(&patterns.to_text()), Ok(patterns));
            }
        }
    }

    #[test]
    fn what_is_no_pattern_is_refused_with_its_line() {
        for (text, said) in [
            ("", "`patterns.codes` has 0 entries"),
            ("# nothing", "`patterns.codes` has 0 entries"),
            ("+-\n\n+-+", "line 3: a row of 3 taxels; the rows before it have 2"),
            ("+-\n256 1", "line 2: `256`"),
            ("+x-", "line 1: `+x-`"),
            ("1 -1", "line 1: `-1`"),
            ("nan", "line 1: `nan`"),
        ] {
            let error = parse_patterns(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text:?}: {error}");
        }
    }
}
