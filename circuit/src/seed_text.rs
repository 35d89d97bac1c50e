//! Lists of seeds as text.

/// Size of the largest file of seeds that is read, bytes: a million seeds in any notation.
pub const MAX_SEEDS_BYTES: u64 = 1 << 24;
/// Characters of a wrong word that an error repeats: a few more than a seed has.
const SHOWN: usize = 20;

/// A word that is not a seed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: seed = `{word}` is not one of the whole numbers in [0, 4294967295]")]
pub struct SeedTextError {
    /// Line, from 1.
    pub line: usize,
    /// The word, shortened.
    pub word: String,
}

/// Reads seeds, one a taxel in row-major order: whole numbers in [0, 4294967295], decimal or hexadecimal (0x…),
/// separated by spaces, commas or line ends. A # starts a comment. A JSON list of numbers is accepted, too.
///
/// ```
/// use spts_circuit::parse_seeds;
///
/// assert_eq!(parse_seeds("# two cells\n8\n0x09\n")?, [8, 9]);
/// assert_eq!(parse_seeds("[8, 9]")?, [8, 9]);
/// assert_eq!(parse_seeds("8\n-1").unwrap_err().line, 2);
/// # Ok::<(), spts_circuit::SeedTextError>(())
/// ```
///
/// # Errors
/// [`SeedTextError`] for the first word that is not a seed.
pub fn parse_seeds(text: &str) -> Result<Vec<u32>, SeedTextError> {
    let trimmed = text.trim();
    let json = trimmed.starts_with('[') && trimmed.ends_with(']');
    let between = |c: char| matches!(c, ',' | ' ' | '\t' | '\r') || (json && matches!(c, '[' | ']'));
    let mut seeds = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        for word in line.split(between).filter(|word| !word.is_empty()) {
            let seed = match word.strip_prefix("0x") {
                Some(digits) => u32::from_str_radix(digits, 16),
                None => word.parse(),
            };
            let seed = seed.map_err(|_| SeedTextError {
                line: index + 1,
                word: word.chars().take(SHOWN).collect(),
            })?;
            seeds.push(seed);
        }
    }
    Ok(seeds)
}
