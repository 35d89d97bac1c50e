//! Skins on several wires: which taxel is on which.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::sync::Arc;

/// Most wires of a skin.
const MAX_WIRES: usize = 4096;

/// An entry of `[[wires]]` in a scene or a readout profile: one wire (`rows` and `cols`, or `taxels`), or all wires of
/// the skin by a rule (`bands`, `blocks` or `round_robin`). A list without entries is one wire.
///
/// ```toml
/// [[wires]]
/// bands = 8             # eight wires, each for whole rows where there are enough of them
///
/// # or  blocks = [2, 4]      2 × 4 wires, each for a block of rows and columns
/// # or  round_robin = 8      taxel k is on wire k mod 8
/// # or, an entry for every wire:
/// #     rows = [0, 4]        rows 0 to 4
/// #     cols = [0, 9]        columns 0 to 9 of all rows, or of those in `rows`
/// #     taxels = [0, 7, 93]  these taxels, counted from 0 row by row
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WireConfig {
    /// Wires, each for a band of the skin: whole rows where there are enough of them, else consecutive taxels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bands: Option<usize>,
    /// Wires down and across, each for a block of the skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blocks: Option<[usize; 2]>,
    /// Wires that take the taxels in turn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub round_robin: Option<usize>,
    /// First and last row of one wire's taxels, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<[usize; 2]>,
    /// First and last column of one wire's taxels, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cols: Option<[usize; 2]>,
    /// Taxels of one wire, from 0 and row by row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taxels: Option<Vec<usize>>,
}

/// Which of several wires every taxel is on. All wires are clocked together and sampled at once.
///
/// ```
/// use spts_circuit::{WireConfig, Wires};
/// use spts_models::SkinLayout;
///
/// let bands = WireConfig { bands: Some(2), ..WireConfig::default() };
/// let wires = Wires::new(&[bands], &SkinLayout::default())?.expect("more than one wire");
/// assert_eq!((wires.count(), wires.of(49), wires.of(50)), (2, 0, 1));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wires {
    of: Arc<[u16]>,
    /// Taxels of every wire, in increasing order.
    taxels: Arc<[Vec<u32>]>,
}

impl Wires {
    /// The wires of `entries` on a skin with this layout; `None` for one wire.
    ///
    /// # Errors
    /// [`Refusal`] for an entry that is not valid, a taxel on no wire or on two, or too many wires.
    pub fn new(entries: &[WireConfig], layout: &SkinLayout) -> Result<Option<Self>, Refusal> {
        let taxels = layout.taxels();
        let mut of: Vec<Option<usize>> = vec![None; taxels];
        let mut count = 0;
        for (index, entry) in entries.iter().enumerate() {
            let at = |error: Refusal| error.at(format!("`wires`[{index}]"));
            let (wires, wire_of) = entry.assigned(layout).map_err(at)?;
            if count + wires > MAX_WIRES.min(taxels) {
                let most = MAX_WIRES.min(taxels);
                return Err(at(Refusal::new(format!("{} wires; valid: [1, {most}]", count + wires))));
            }
            for (taxel, wire) in wire_of {
                if let Some(before) = of[taxel].replace(count + wire) {
                    return Err(at(Refusal::new(format!("taxel {taxel} is on wire {before} already"))));
                }
            }
            count += wires;
        }
        if count <= 1 && of.iter().all(|wire| wire.is_some() == (count == 1)) {
            return Ok(None);
        }
        match of.iter().position(Option::is_none) {
            Some(taxel) => {
                let place = format!("row {}, column {}", taxel / layout.cols(), taxel % layout.cols());
                Err(Refusal::new(format!("`wires`: taxel {taxel} ({place}) is on none of the {count} wires")))
            }
            None => Self::of_taxels(of.into_iter().flatten().collect()),
        }
    }

    /// Wires by the wire of every taxel; `None` for one wire.
    fn of_taxels(of: Vec<usize>) -> Result<Option<Self>, Refusal> {
        let count = of.iter().max().map_or(0, |wire| wire + 1);
        if count > MAX_WIRES {
            return Err(Refusal::new(format!("wire {} of a taxel is outside [0, {}]", count - 1, MAX_WIRES - 1)));
        }
        let mut taxels = vec![Vec::new(); count];
        for (taxel, wire) in (0_u32..).zip(&of) {
            taxels[*wire].push(taxel);
        }
        if let Some(wire) = taxels.iter().position(Vec::is_empty) {
            return Err(Refusal::new(format!("wire {wire} has no taxel")));
        }
        let of = of.iter().map(|wire| u16::try_from(*wire).unwrap_or(u16::MAX)).collect();
        Ok((count > 1).then(|| Self { of, taxels: taxels.into() }))
    }

    /// The same as entries of `[[wires]]`.
    pub fn entries(&self) -> Vec<WireConfig> {
        let entry = |own: &Vec<u32>| WireConfig {
            taxels: Some(own.iter().map(|k| *k as usize).collect()),
            ..WireConfig::default()
        };
        self.taxels.iter().map(entry).collect()
    }

    /// Number of wires.
    pub fn count(&self) -> usize {
        self.taxels.len()
    }

    /// Wire of a taxel, from 0.
    ///
    /// # Panics
    /// If there is no such taxel.
    pub fn of(&self, taxel: usize) -> usize {
        usize::from(self.of[taxel])
    }

    /// Wire of every taxel.
    pub fn all(&self) -> &[u16] {
        &self.of
    }

    /// Taxels of a wire, in increasing order.
    ///
    /// # Panics
    /// If there is no such wire.
    pub fn taxels(&self, wire: usize) -> &[u32] {
        &self.taxels[wire]
    }

    /// Taxels of every wire as bits, ⌈taxels/64⌉ words each: bit k is set if taxel k is on it.
    pub fn masks(&self) -> Vec<u64> {
        let words = self.of.len().div_ceil(64);
        let mut masks = vec![0; self.count() * words];
        for (k, wire) in self.of.iter().enumerate() {
            masks[usize::from(*wire) * words + k / 64] |= 1 << (k % 64);
        }
        masks
    }

    /// Taxels of the wire that has the most.
    pub fn most_taxels(&self) -> usize {
        self.taxels.iter().map(Vec::len).max().unwrap_or(0)
    }
}

impl WireConfig {
    /// `wires` bands.
    pub fn bands(wires: usize) -> Self {
        Self { bands: Some(wires), ..Self::default() }
    }

    /// Number of wires of the entry, and the wire of every taxel that it names.
    fn assigned(&self, layout: &SkinLayout) -> Result<(usize, Vec<(usize, usize)>), Refusal> {
        let (rows, cols, taxels) = (layout.rows(), layout.cols(), layout.taxels());
        let all = |wires: usize, wire: &dyn Fn(usize) -> usize| {
            Ok((wires, (0..taxels).map(|taxel| (taxel, wire(taxel))).collect()))
        };
        let number = |field: &str, wires: usize, most: usize| match wires {
            wires if (1..=most.min(MAX_WIRES)).contains(&wires) => Ok(wires),
            wires => Err(Refusal::range(field, wires, format!("[1, {}]", most.min(MAX_WIRES)))),
        };
        let one_wire = self.rows.is_some() || self.cols.is_some();
        match (self.bands, self.blocks, self.round_robin, one_wire, &self.taxels) {
            (Some(bands), None, None, false, None) => {
                let bands = number("bands", bands, taxels)?;
                if bands <= rows {
                    return all(bands, &|taxel| part(taxel / cols, rows, bands));
                }
                all(bands, &|taxel| part(taxel, taxels, bands))
            }
            (None, Some([down, across]), None, false, None) => {
                let (down, across) = (number("blocks[0]", down, rows)?, number("blocks[1]", across, cols)?);
                all(down * across, &|taxel| part(taxel / cols, rows, down) * across + part(taxel % cols, cols, across))
            }
            (None, None, Some(wires), false, None) => {
                let wires = number("round_robin", wires, taxels)?;
                all(wires, &|taxel| taxel % wires)
            }
            (None, None, None, true, None) => {
                let span = |field: &str, span: Option<[usize; 2]>, most: usize| match span {
                    None => Ok(0..most),
                    Some([first, last]) if first <= last && last < most => Ok(first..last + 1),
                    Some(found) => {
                        let valid = format!("a first and a last one in [0, {}]", most - 1);
                        Err(Refusal::new(format!("`{field}` = {found:?} is not {valid}")))
                    }
                };
                let (rows, across) = (span("rows", self.rows, rows)?, span("cols", self.cols, cols)?);
                let own = rows.flat_map(|row| across.clone().map(move |col| (row * cols + col, 0)));
                Ok((1, own.collect()))
            }
            (None, None, None, false, Some(list)) => {
                if let Some(taxel) = list.iter().find(|taxel| **taxel >= taxels) {
                    return Err(Refusal::range("taxels", taxel, format!("[0, {}]", taxels - 1)));
                }
                if list.is_empty() {
                    return Err(Refusal::new("`taxels` is empty: a wire has at least one"));
                }
                Ok((1, list.iter().map(|taxel| (*taxel, 0)).collect()))
            }
            _ => {
                let ways = "`bands`, `blocks`, `round_robin`, `rows` and `cols`, or `taxels`";
                Err(Refusal::new(format!("an entry has exactly one of {ways}")))
            }
        }
    }
}

/// The part of `of` things in which number `index` is, of `parts` that differ by one at most, the largest first.
fn part(index: usize, of: usize, parts: usize) -> usize {
    let (size, larger) = (of / parts, of % parts);
    let first = larger * (size + 1);
    if index < first { index / (size + 1) } else { larger + (index - first) / size }
}

/// As runs: a wire and how many taxels in a row are on it.
impl Serialize for Wires {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let runs = self.of.chunk_by(PartialEq::eq).map(|run| (run[0], run.len()));
        serializer.collect_seq(runs)
    }
}

impl<'de> Deserialize<'de> for Wires {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        /// Most taxels: as many as have seeds.
        const MOST: usize = 1 << 24;
        let runs: Vec<(u16, usize)> = Vec::deserialize(deserializer)?;
        let taxels = runs.iter().fold(0, |sum: usize, (_, run)| sum.saturating_add(*run));
        if taxels > MOST {
            return Err(de::Error::custom(format!("`wires` of {taxels} taxels; valid: [2, {MOST}]")));
        }
        let of = runs.iter().flat_map(|(wire, run)| std::iter::repeat_n(usize::from(*wire), *run));
        let wires = Self::of_taxels(of.collect()).map_err(de::Error::custom)?;
        wires.ok_or_else(|| de::Error::custom("`wires` has one wire; it is left out then"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wires(text: &str, rows: usize, cols: usize) -> Result<Option<Wires>, Refusal> {
        #[derive(Deserialize)]
        struct File {
            wires: Vec<WireConfig>,
        }
        let file: File = toml::from_str(text).unwrap();
        Wires::new(&file.wires, &SkinLayout::new(rows, cols, 5e-3, 3e-3).unwrap())
    }

    /// By hand, on 3 × 4 taxels.
    #[test]
    fn every_way_to_say_it() {
        for (text, expected) in [
            ("bands = 2", "000000001111"),
            ("bands = 3", "000011112222"),
            ("bands = 4", "000111222333"),
            ("bands = 5", "000111223344"),
            ("blocks = [2, 2]", "001100112233"),
            ("round_robin = 3", "012012012012"),
            ("rows = [0, 1]\n[[wires]]\nrows = [2, 2]", "000000001111"),
            (
                "rows = [1, 2]\ncols = [0, 1]\n[[wires]]\nrows = [0, 0]\n[[wires]]\nrows = [1, 2]\ncols = [2, 3]",
                "111100220022",
            ),
            ("taxels = [0, 11]\n[[wires]]\ntaxels = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]", "011111111110"),
        ] {
            let found = wires(&format!("[[wires]]\n{text}"), 3, 4).unwrap().unwrap();
            let shown: String = found.all().iter().map(u16::to_string).collect();
            assert_eq!(shown, expected, "{text}");
            let json = serde_json::to_string(&found).unwrap();
            assert_eq!(serde_json::from_str::<Wires>(&json).unwrap(), found, "{json}");
            let again = Wires::new(&found.entries(), &SkinLayout::new(3, 4, 5e-3, 3e-3).unwrap());
            assert_eq!(again.unwrap().unwrap(), found);
            for wire in 0..found.count() {
                assert!(found.taxels(wire).iter().all(|k| found.of(*k as usize) == wire));
            }
        }
        assert_eq!(wires("wires = []", 3, 4).unwrap(), None);
        assert_eq!(wires("[[wires]]\nbands = 1", 3, 4).unwrap(), None);
    }

    #[test]
    fn what_is_no_wiring_is_refused() {
        for (text, said) in [
            ("bands = 0", "`wires`[0]: `bands` = 0 is outside [1, 12]"),
            ("bands = 13", "`bands` = 13 is outside [1, 12]"),
            ("blocks = [4, 1]", "`blocks[0]` = 4 is outside [1, 3]"),
            ("rows = [0, 1]", "taxel 8 (row 2, column 0) is on none of the 1 wires"),
            ("rows = [0, 3]", "`rows` = [0, 3] is not a first and a last one in [0, 2]"),
            ("rows = [0, 1]\n[[wires]]\nrows = [1, 2]", "`wires`[1]: taxel 4 is on wire 0 already"),
            ("taxels = [12]", "`taxels` = 12 is outside [0, 11]"),
            ("taxels = []", "`taxels` is empty"),
            ("bands = 2\nround_robin = 2", "exactly one of"),
            ("", "exactly one of"),
        ] {
            let error = wires(&format!("[[wires]]\n{text}"), 3, 4).unwrap_err().to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
        for (json, said) in [
            ("[[0, 4]]", "one wire"),
            ("[[0, 4], [2, 1]]", "wire 1 has no taxel"),
            ("[[0, 18446744073709551615], [1, 1]]", "valid: [2, 16777216]"),
            ("[[0, 1], [60000, 1]]", "outside [0, 4095]"),
        ] {
            let error = serde_json::from_str::<Wires>(json).unwrap_err().to_string();
            assert!(error.contains(said), "{json}: {error}");
        }
    }
}
