//! Drive levels of every taxel at every measurement: modes, codes, patterns, and the rows of the weight matrix.

use super::lcg::{ANALOG_SCALE, Jump, Seeding, Seeds, analog, binary};
use crate::wires::Wires;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The two ways to read the skin: one taxel after the other, or all taxels weighted and added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// One taxel a measurement, in row-major order.
    Raster,
    /// All taxels at once, with pseudorandom weights.
    Compressive,
}

impl Mode {
    /// Name of the profile section that lists the effects of this readout.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Compressive => "compressive",
        }
    }
}

/// Kind of the levels that the cells put out.
///
/// ```
/// use spts_circuit::WeightMode;
///
/// // the cell with seed 8 at its first three rows
/// let levels: Vec<f64> = (0..3).map(|row| WeightMode::Binary.level_from_seed(8, row)).collect();
/// assert!(levels.iter().all(|level| level.abs() == 1.0));
/// let analog = WeightMode::Analog.level_from_seed(8, 0);
/// assert_eq!(analog.signum(), levels[0], "both use the generator's top byte");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WeightMode {
    /// One taxel after another: level 1 (code 255) on the scanned one and 0 (code 126, mid-scale) on the others.
    Raster,
    /// Eight-bit pseudorandom levels: the top byte of the generator.
    Analog,
    /// Pseudorandom ±1: code 255 when the top byte is 128 or more, code 0 otherwise.
    Binary,
}

impl WeightMode {
    /// Level that a generator in `state` stands for; in raster mode no cell uses its generator, and the level is 0.
    #[inline]
    pub(crate) fn level(self, state: u32) -> f64 {
        match self {
            Self::Raster => 0.0,
            Self::Analog => analog(state),
            Self::Binary => binary(state),
        }
    }

    /// Level at `row` (counted from loading the seeds) of a cell with the generator seed `seed`. In raster mode no cell
    /// uses its seed, and the level is 0.
    pub fn level_from_seed(self, seed: u32, row: u64) -> f64 {
        self.level(Jump::new(row.wrapping_add(1)).apply(seed))
    }

    /// The readout that uses these levels.
    pub fn readout(self) -> Mode {
        match self {
            Self::Raster => Mode::Raster,
            Self::Analog | Self::Binary => Mode::Compressive,
        }
    }

    /// Name, as used in profiles and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Analog => "analog",
            Self::Binary => "binary",
        }
    }
}

/// Code of level 1.
pub(crate) const FULL_SCALE: u8 = 255;
/// Code of level 0.
pub(crate) const NEUTRAL: u8 = 126;

impl WeightMode {
    /// Drive level of DAC code k in this mode: (k − 127.5)/127.5, and 0 for the neutral code 126, to which the
    /// amplifier's bias is trimmed. In analog mode 126 is an ordinary level, because the generator's top byte can be
    /// 126.
    pub fn code_level(self, code: u8) -> f64 {
        if code == NEUTRAL && self != Self::Analog {
            return 0.0;
        }
        (f64::from(code) - ANALOG_SCALE) / ANALOG_SCALE
    }
}

/// Nearest code of a level, the neutral one of level 0.
#[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
pub(crate) fn code_of(level: f64) -> u8 {
    if level == 0.0 { NEUTRAL } else { (ANALOG_SCALE * (1.0 + level)).round() as u8 }
}

/// A list `field` of `len` entries, where [1, `most`] are valid.
fn wrong_length(field: &str, len: usize, most: usize) -> Refusal {
    Refusal::new(format!("`{field}` has {len} entries; valid: [1, {most}]"))
}

/// A key `field` that `mode` does not use.
pub(crate) fn not_in_mode(field: &str, mode: WeightMode) -> Refusal {
    let valid = "valid modes: \"analog\" and \"binary\"";
    Refusal::new(format!("`{field}` does not go with `mode` = {:?}; {valid}", mode.name()))
}

/// Most codes in a pattern.
const MAX_CODES: usize = 1 << 30;

/// Levels that the cells repeat: row r of the weights is row r mod `period` of the pattern.
///
/// As text: `{"period": 2, "codes": [0, 255, 255, 0]}`, with the codes in row-major order, or one text in the format of
/// [`parse_patterns`](crate::parse_patterns).
///
/// ```
/// use spts_circuit::{Patterns, WeightMode, Weights};
///
/// let patterns = Patterns::new(2, vec![0, 255, 255, 0])?;
/// let weights = Weights::with_patterns(WeightMode::Binary, patterns)?;
/// assert_eq!([weights.level(0, 6), weights.level(1, 6), weights.level(0, 7)], [-1.0, 1.0, 1.0]);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(into = "PatternsConfig")]
pub struct Patterns {
    taxels: usize,
    codes: Vec<u8>,
}

/// Text of [`Patterns`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PatternsConfig {
    period: usize,
    codes: Vec<u8>,
}

impl TryFrom<PatternsConfig> for Patterns {
    type Error = Refusal;
    fn try_from(config: PatternsConfig) -> Result<Self, Refusal> {
        Self::new(config.period, config.codes)
    }
}

impl From<Patterns> for PatternsConfig {
    fn from(patterns: Patterns) -> Self {
        Self { period: patterns.period(), codes: patterns.codes }
    }
}

impl Patterns {
    /// A pattern of `period` rows of DAC codes in row-major order. Code k is level (k − 127.5)/127.5. The number of
    /// taxels is the number of codes divided by `period`.
    ///
    /// # Errors
    /// [`Refusal`] for no code, more than 2³⁰ codes, or a number of codes that is not a multiple of `period`.
    pub fn new(period: usize, codes: Vec<u8>) -> Result<Self, Refusal> {
        let len = codes.len();
        if !(1..=MAX_CODES).contains(&len) {
            return Err(wrong_length("patterns.codes", len, MAX_CODES));
        }
        match len.checked_div(period) {
            Some(taxels) if taxels > 0 && taxels * period == len => Ok(Self { taxels, codes }),
            _ => Err(Refusal::new(format!(
                "`patterns.codes` has {len} entries, not a positive multiple of `patterns.period` = {period}"
            ))),
        }
    }

    /// A pattern of `period` rows, from `levels` in [−1, 1], row-major. Every cell puts out the code nearest to its
    /// level.
    ///
    /// ```
    /// use spts_circuit::Patterns;
    ///
    /// assert_eq!(Patterns::of_levels(1, &[-1.0, 1.0])?.row(0), [0, 255]);
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// As [`Patterns::new`].
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "float to integer casts saturate")]
    pub fn of_levels(period: usize, levels: &[f64]) -> Result<Self, Refusal> {
        let code = |level: &f64| (127.5 * (1.0 + level)).round() as u8;
        Self::new(period, levels.iter().map(code).collect())
    }

    /// Number of rows after which the pattern repeats.
    pub fn period(&self) -> usize {
        self.codes.len() / self.taxels
    }

    /// Number of taxels: the length of a row.
    pub fn taxels(&self) -> usize {
        self.taxels
    }

    /// Codes of row `row`, one a taxel. Rows beyond the period repeat.
    pub fn row(&self, row: u64) -> &[u8] {
        let first = usize::try_from(row % self.period() as u64).unwrap_or(0) * self.taxels;
        &self.codes[first..first + self.taxels]
    }

    /// Writes the codes of as many consecutive rows as `out` holds, starting with `first_row`.
    pub(crate) fn fill(&self, first_row: u64, out: &mut [u8]) {
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            out.copy_from_slice(self.row(row));
        }
    }

    /// Checks that cells in `mode` can put out every code.
    pub(crate) fn check(&self, mode: WeightMode) -> Result<(), Refusal> {
        match mode {
            WeightMode::Raster => Err(not_in_mode("patterns", mode)),
            WeightMode::Analog => Ok(()),
            WeightMode::Binary => match self.codes.iter().position(|code| !matches!(code, 0 | 255)) {
                None => Ok(()),
                Some(index) => {
                    let (code, valid) = (self.codes[index], "0 (level −1) and 255 (level +1)");
                    let place = format!("`patterns.codes`[{index}] = {code}");
                    Err(Refusal::new(format!("{place} is no binary level; valid: {valid}")))
                }
            },
        }
    }
}

/// Where the levels of [`Weights`](crate::Weights) come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LevelSource {
    /// The cells' generators, seeded by a rule.
    Seeding(Seeding),
    /// The cells' generators, with a given seed for each taxel.
    Seeds(Arc<[u32]>),
    /// Given codes.
    Patterns(Arc<Patterns>),
}

impl LevelSource {
    /// Seeds of the taxels; `None` when the levels come from a pattern.
    #[inline]
    pub(crate) fn seeds(&self) -> Option<Seeds<'_>> {
        match self {
            Self::Seeding(seeding) => Some(Seeds::Rule(*seeding)),
            Self::Seeds(seeds) => Some(Seeds::Given(seeds)),
            Self::Patterns(_) => None,
        }
    }
}

/// Most taxels that seeds are listed for.
const MAX_SEEDS: usize = 1 << 24;

/// Drive levels of a skin of `taxels` taxels. Row `r` holds the level of every taxel at measurement `r`; rows are
/// counted from 0 in clock edges since loading the seeds.
///
/// A level is the drive divided by its full scale. DAC code k drives (k − 127.5)/127.5: codes 0 and 255 are −1 and +1,
/// and the analog levels lie between them. The neutral code 126 of the raster scan counts as 0, because the amplifier's
/// bias is trimmed to it (the effect `drive_offset` models the remainder). Row 0 is the generator's state after ONE
/// step from the seed.
///
/// The levels come from the cells' generators, seeded by a rule ([`Weights::new`]) or with given seeds
/// ([`Weights::with_seeds`]), or from a pattern ([`Weights::with_patterns`]). The examples read
/// them from text, JSON or TOML: seeds by a rule, given seeds, a pattern, and a raster scan.
///
/// ```
/// use spts_circuit::{Seeding, WeightMode, Weights};
///
/// let mixed: Weights =
///     serde_json::from_str(r#"{"mode": "binary", "taxels": 100, "generator": "lcg", "seeding": "mixed"}"#)?;
/// assert_eq!(mixed, Weights::new(WeightMode::Binary, Seeding::Mixed, 100));
///
/// let seeded: Weights = serde_json::from_str(r#"{"mode": "analog", "generator": "lcg", "seeds": [17, 4, 90]}"#)?;
/// assert_eq!((seeded.taxels(), seeded.seed(2)), (3, Some(90)));
///
/// let patterned: Weights =
///     serde_json::from_str(r#"{"mode": "binary", "patterns": {"period": 2, "codes": [0, 255, 255, 0]}}"#)?;
/// assert_eq!(patterned.level(1, 2), 1.0);
///
/// let raster: Weights = serde_json::from_str(r#"{"mode": "raster", "taxels": 100}"#)?;
/// assert_eq!(raster.level(7, 107), 1.0);
/// # Ok::<(), serde_json::Error>(())
/// ```
///
/// `generator` may be omitted. `taxels` may be given together with a list and is then checked.
///
/// On several wires ([`Weights::wired`]) rows count samples and not clock edges: at every edge each wire gives one
/// sample, so that row r is that of wire r mod W at edge ⌊r/W⌋, with the levels of its own taxels and 0 elsewhere. A
/// raster scan has a row for every taxel in any case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Weights {
    mode: WeightMode,
    source: LevelSource,
    taxels: u32,
    wires: Option<Wires>,
}

impl Weights {
    /// Weights of `taxels` taxels whose generators are seeded by a rule.
    pub fn new(mode: WeightMode, seeding: Seeding, taxels: u32) -> Self {
        Self { mode, source: LevelSource::Seeding(seeding), taxels, wires: None }
    }

    /// Weights with one generator seed for each taxel.
    ///
    /// # Errors
    /// [`Refusal`] for no seed, more than 2²⁴ seeds, or the raster mode, which uses no seeds.
    pub fn with_seeds(mode: WeightMode, seeds: impl Into<Arc<[u32]>>) -> Result<Self, Refusal> {
        let (field, seeds) = ("seeds", seeds.into());
        if mode == WeightMode::Raster {
            return Err(not_in_mode(field, mode));
        }
        match u32::try_from(seeds.len()) {
            Ok(taxels) if (1..=MAX_SEEDS).contains(&seeds.len()) => {
                Ok(Self { mode, source: LevelSource::Seeds(seeds), taxels, wires: None })
            }
            _ => Err(wrong_length(field, seeds.len(), MAX_SEEDS)),
        }
    }

    /// Weights that repeat `patterns`. In analog mode every code is a level; in binary mode 0 is −1 and 255 is +1.
    ///
    /// # Errors
    /// [`Refusal`] for other codes in binary mode, or for the raster mode, which scans its taxels in order.
    pub fn with_patterns(mode: WeightMode, patterns: Patterns) -> Result<Self, Refusal> {
        patterns.check(mode)?;
        let taxels = u32::try_from(patterns.taxels()).unwrap_or(u32::MAX);
        Ok(Self { mode, source: LevelSource::Patterns(Arc::new(patterns)), taxels, wires: None })
    }

    /// The same levels with the taxels on `wires`; `None` for one wire.
    ///
    /// ```
    /// use spts_circuit::{Seeding, WeightMode, Weights, WireConfig, Wires};
    /// use spts_models::SkinLayout;
    ///
    /// let one = Weights::new(WeightMode::Binary, Seeding::Mixed, 100);
    /// let bands = Wires::new(&[WireConfig::bands(2)], &SkinLayout::default())?;
    /// let two = one.clone().wired(bands)?;
    /// // the second sample at the fourth clock edge is of the second wire
    /// assert_eq!((two.level(20, 7), two.level(70, 7)), (0.0, one.level(70, 3)));
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// [`Refusal`] for wires of another number of taxels.
    pub fn wired(self, wires: Option<Wires>) -> Result<Self, Refusal> {
        match wires.as_ref().map(|wires| wires.all().len()) {
            Some(found) if found != self.taxels() => {
                Err(Refusal::new(format!("`wires` is for {found} taxels; expected {}", self.taxels)))
            }
            _ => Ok(Self { wires, ..self }),
        }
    }

    /// The wires, if there are several.
    pub fn wires(&self) -> Option<&Wires> {
        self.wires.as_ref()
    }

    /// Number of wires.
    pub fn wire_count(&self) -> usize {
        self.wires.as_ref().map_or(1, Wires::count)
    }

    /// Weights of the taxels of one wire alone, a row for each of its samples. Those of the only wire are all.
    ///
    /// # Panics
    /// If there is no such wire.
    pub fn of_wire(&self, wire: usize) -> Self {
        let Some(wires) = &self.wires else {
            return self.clone();
        };
        let own = wires.taxels(wire);
        let source = match (self.mode, &self.source) {
            (WeightMode::Raster, source) => source.clone(),
            (_, LevelSource::Seeding(seeding)) => LevelSource::Seeds(own.iter().map(|k| seeding.seed(*k)).collect()),
            (_, LevelSource::Seeds(seeds)) => LevelSource::Seeds(own.iter().map(|k| seeds[*k as usize]).collect()),
            (_, LevelSource::Patterns(patterns)) => {
                let rows = (0..patterns.period() as u64).map(|row| patterns.row(row));
                let codes = rows.flat_map(|row| own.iter().map(|k| row[*k as usize])).collect();
                LevelSource::Patterns(Arc::new(Patterns { taxels: own.len(), codes }))
            }
        };
        Self { mode: self.mode, source, taxels: u32::try_from(own.len()).unwrap_or(u32::MAX), wires: None }
    }

    /// Wire and clock edge of the sample `row`.
    fn sample(&self, row: u64) -> (usize, u64) {
        let count = self.wire_count() as u64;
        (usize::try_from(row % count).unwrap_or(0), row / count)
    }

    /// Wires of the compressive rows, if there are several.
    fn woven(&self) -> Option<&Wires> {
        self.wires.as_ref().filter(|_| self.mode != WeightMode::Raster)
    }

    /// How many of the samples before `row` are of `wire`.
    pub(crate) fn before(&self, wire: usize, row: u64) -> u64 {
        match (&self.wires, self.mode) {
            (None, _) => row,
            (Some(wires), WeightMode::Raster) => {
                let (own, taxels) = (wires.taxels(wire), u64::from(self.taxels));
                let within = row % taxels;
                row / taxels * own.len() as u64 + own.partition_point(|k| u64::from(*k) < within) as u64
            }
            (Some(wires), _) => (row + (wires.count() - 1 - wire) as u64) / wires.count() as u64,
        }
    }

    /// Number of taxels: the length of a row, and the period of the raster.
    pub fn taxels(&self) -> usize {
        self.taxels as usize
    }

    /// Kind of the levels.
    pub fn mode(&self) -> WeightMode {
        self.mode
    }

    /// Source of the levels.
    pub fn source(&self) -> &LevelSource {
        &self.source
    }

    /// The pattern that the levels repeat; `None` if they come from generators.
    pub fn patterns(&self) -> Option<&Patterns> {
        match &self.source {
            LevelSource::Patterns(patterns) => Some(patterns),
            _ => None,
        }
    }

    /// Seed of taxel `taxel`; `None` if the levels come from a pattern, or there is no such taxel.
    pub fn seed(&self, taxel: usize) -> Option<u32> {
        (taxel < self.taxels()).then_some(())?;
        Some(self.seeds()?.seed(taxel))
    }

    /// Seeds of the taxels; `None` when the levels come from a pattern.
    #[inline]
    pub(crate) fn seeds(&self) -> Option<Seeds<'_>> {
        self.source.seeds()
    }

    /// Level of `taxel` at `row`, in O(log row).
    ///
    /// # Panics
    /// If the levels come from a list or a pattern without such a taxel.
    pub fn level(&self, taxel: u32, row: u64) -> f64 {
        let mut row = row;
        if let Some(wires) = self.woven() {
            let (wire, edge) = self.sample(row);
            if wires.of(taxel as usize) != wire {
                return 0.0;
            }
            row = edge;
        }
        match (self.mode, &self.source) {
            (WeightMode::Raster, _) => f64::from(row.checked_rem(u64::from(self.taxels)) == Some(u64::from(taxel))),
            (mode, LevelSource::Patterns(patterns)) => mode.code_level(patterns.row(row)[taxel as usize]),
            (mode, LevelSource::Seeding(seeding)) => mode.level_from_seed(seeding.seed(taxel), row),
            (mode, LevelSource::Seeds(seeds)) => mode.level_from_seed(seeds[taxel as usize], row),
        }
    }

    /// Writes the levels of `taxel` at as many consecutive rows as `out` holds, starting with `first_row`.
    pub(crate) fn fill_levels(&self, taxel: u32, first_row: u64, out: &mut [f64]) {
        let (Some(seeds), WeightMode::Analog | WeightMode::Binary, None) = (self.seeds(), self.mode, &self.wires)
        else {
            for (out, row) in out.iter_mut().zip(first_row..) {
                *out = self.level(taxel, row);
            }
            return;
        };
        let mut state = Jump::new(first_row).apply(seeds.seed(taxel as usize));
        for out in out {
            state = Jump::ONE.apply(state);
            *out = self.mode.level(state);
        }
    }

    /// Fills `out` with consecutive rows from `first_row` on, row-major.
    ///
    /// # Panics
    /// If the length of `out` is not a whole number of rows.
    pub fn fill_rows(&self, first_row: u64, out: &mut [f64]) {
        assert!(
            out.len().is_multiple_of(self.taxels().max(1)),
            "{} values are not a whole number of rows of {}",
            out.len(),
            self.taxels
        );
        let taxels = self.taxels().max(1);
        if let Some(wires) = self.woven() {
            return self.fill_woven(wires, first_row, out);
        }
        if let (Some(seeds), WeightMode::Analog | WeightMode::Binary) = (self.seeds(), self.mode) {
            let jump = Jump::new(first_row);
            let mut states: Vec<u32> = (0..self.taxels()).map(|k| jump.apply(seeds.seed(k))).collect();
            match self.mode {
                WeightMode::Analog => generate(&mut states, out, analog),
                _ => generate(&mut states, out, binary),
            }
            return;
        }
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(taxels)) {
            match &self.source {
                LevelSource::Patterns(patterns) => {
                    let codes = patterns.row(row).iter();
                    out.iter_mut().zip(codes).for_each(|(out, code)| *out = self.mode.code_level(*code));
                }
                _ => {
                    out.fill(0.0);
                    let scanned = row.checked_rem(u64::from(self.taxels)).map(usize::try_from);
                    if let Some(level) = scanned.and_then(|k| out.get_mut(k.ok()?)) {
                        *level = 1.0;
                    }
                }
            }
        }
    }

    /// Fills `out` with rows of several wires: the levels of all taxels at a clock edge, of which every wire has its
    /// own.
    fn fill_woven(&self, wires: &Wires, first_row: u64, out: &mut [f64]) {
        let all = Self { wires: None, ..self.clone() };
        let (mut levels, mut at) = (vec![0.0; self.taxels()], None);
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels().max(1))) {
            let (wire, edge) = self.sample(row);
            if at != Some(edge) {
                all.fill_rows(edge, &mut levels);
                at = Some(edge);
            }
            let own = wires.all().iter().zip(&levels);
            out.iter_mut()
                .zip(own)
                .for_each(|(out, (of, level))| *out = if usize::from(*of) == wire { *level } else { 0.0 });
        }
    }

    /// Fills `out` with the DAC codes of the levels at consecutive rows from `first_row` on, row-major.
    ///
    /// # Panics
    /// If the length of `out` is not a whole number of rows.
    pub fn fill_codes(&self, first_row: u64, out: &mut [u8]) {
        let mut levels = vec![0.0; out.len()];
        self.fill_rows(first_row, &mut levels);
        out.iter_mut().zip(&levels).for_each(|(out, level)| *out = code_of(*level));
    }
}

/// Steps the generators once a row, and writes what `level` makes of their states.
#[inline(always)]
fn generate(states: &mut [u32], out: &mut [f64], level: impl Fn(u32) -> f64) {
    for out in out.chunks_exact_mut(states.len().max(1)) {
        for (state, out) in states.iter_mut().zip(out) {
            *state = Jump::ONE.apply(*state);
            *out = level(*state);
        }
    }
}

/// Consecutive rows of the weight matrix Φ, one for each measurement. No row is stored; the matrix of a large skin can
/// be filled piece by piece with [`WeightRows::chunks`].
///
/// ```
/// use spts_circuit::{Seeding, WeightMode, WeightRows, Weights};
///
/// let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 100);
/// let rows = WeightRows::new(&weights, 24_300, 20);
/// let phi = rows.to_vec();
/// assert_eq!(phi.len(), 20 * 100);
/// // the same rows in two pieces
/// let pieces: Vec<f64> = rows.chunks(13).flat_map(|piece| piece.to_vec()).collect();
/// assert_eq!(phi, pieces);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct WeightRows<'a> {
    weights: &'a Weights,
    first_row: u64,
    len: usize,
}

impl<'a> WeightRows<'a> {
    /// The `len` rows of `weights` from row `first_row` on, counted from loading the seeds.
    pub fn new(weights: &'a Weights, first_row: u64, len: usize) -> Self {
        Self { weights, first_row, len }
    }

    /// The weights to which the rows belong.
    pub fn weights(&self) -> &'a Weights {
        self.weights
    }

    /// Number of the first row, counted from loading the seeds.
    pub fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Wire of a row, counted from the first; 0 of a raster scan, whose rows are of single taxels.
    pub fn wire(&self, row: usize) -> usize {
        self.weights.woven().map_or(0, |_| self.weights.sample(self.first_row + row as u64).0)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Number of taxels: the length of a row.
    pub fn taxels(&self) -> usize {
        self.weights.taxels()
    }

    /// The rows `start..start + len` of this range of rows, counted from its first.
    ///
    /// # Panics
    /// If there are fewer rows.
    pub fn slice(&self, start: usize, len: usize) -> Self {
        assert!(start + len <= self.len, "rows {start}..{} of {}", start + len, self.len);
        Self::new(self.weights, self.first_row + start as u64, len)
    }

    /// The rows in pieces of `len`; the last piece may be shorter.
    ///
    /// # Panics
    /// If `len` is 0.
    pub fn chunks(self, len: usize) -> impl Iterator<Item = Self> {
        let starts = (0..self.len).step_by(len);
        starts.map(move |start| self.slice(start, len.min(self.len - start)))
    }

    /// Writes the levels, each in [−1, 1], row-major.
    ///
    /// # Panics
    /// If `out` does not have one entry for each row and taxel.
    pub fn fill(&self, out: &mut [f64]) {
        let expected = self.len * self.taxels();
        assert_eq!(out.len(), expected, "one entry a row and taxel");
        self.weights.fill_rows(self.first_row, out);
    }

    /// The levels, each in [−1, 1], row-major.
    pub fn to_vec(&self) -> Vec<f64> {
        let mut rows = vec![0.0; self.len * self.taxels()];
        self.fill(&mut rows);
        rows
    }

    /// Packed signs of binary weights, ⌈taxels/64⌉ words a row: bit k of a row is set if taxel k has the weight +1. On
    /// several wires the bits of taxels on another wire than the row's are not set; their weights are 0, and
    /// [`WeightRows::wire`] says which. `None` if the weights are not binary.
    pub fn sign_bits(&self) -> Option<Vec<u64>> {
        if self.weights.mode() != WeightMode::Binary {
            return None;
        }
        let words = self.taxels().div_ceil(WORD);
        let wires = self.weights.wires();
        let masks = wires.map_or_else(Vec::new, Wires::masks);
        let mut bits = Vec::with_capacity(self.len * words);
        let (mut edges, mut at) = (Edges::new(self.weights, self.weights.sample(self.first_row).1), None);
        for row in (self.first_row..).take(self.len) {
            let (wire, edge) = self.weights.sample(row);
            if at != Some(edge) {
                edges.next();
                at = Some(edge);
            }
            match masks.get(wire * words..(wire + 1) * words) {
                Some(mask) => bits.extend(edges.bits.iter().zip(mask).map(|(bits, mask)| bits & mask)),
                None => bits.extend_from_slice(&edges.bits),
            }
        }
        Some(bits)
    }
}

/// Bits of a word.
const WORD: usize = u64::BITS as usize;

/// Signs of all taxels at one clock edge after another.
struct Edges<'a> {
    weights: &'a Weights,
    /// States of the generators; empty for patterns.
    states: Vec<u32>,
    /// The next edge.
    edge: u64,
    /// Signs at the edge before it, as in [`WeightRows::sign_bits`].
    bits: Vec<u64>,
}

impl<'a> Edges<'a> {
    fn new(weights: &'a Weights, edge: u64) -> Self {
        let jump = Jump::new(edge);
        let states = weights.seeds().map(|seeds| (0..weights.taxels()).map(|k| jump.apply(seeds.seed(k))).collect());
        Self { weights, states: states.unwrap_or_default(), edge, bits: vec![0; weights.taxels().div_ceil(WORD)] }
    }

    fn next(&mut self) {
        if let Some(patterns) = self.weights.patterns() {
            for (word, codes) in self.bits.iter_mut().zip(patterns.row(self.edge).chunks(WORD)) {
                *word = codes.iter().rev().fold(0, |word, code| word << 1 | u64::from(*code == FULL_SCALE));
            }
        }
        for (word, states) in self.bits.iter_mut().zip(self.states.chunks_mut(WORD)) {
            // the sign is the top bit of the state
            states.iter_mut().for_each(|state| *state = Jump::ONE.apply(*state));
            *word = states.iter().rev().fold(0, |word, state| word << 1 | u64::from(state >> 31));
        }
        self.edge += 1;
    }
}

/// Most rows of a window. All 2²⁴ windows of so many are in the sequence, the last one 271,551,075 steps behind state
/// 0.
const MOST_ROWS: usize = 24;
/// Number of states of a generator, and so of seeds.
const STATES: u64 = 1 << 32;

/// Seeds, one a taxel, with which the cells' generators put out `window` in binary mode at rows 0 to M − 1 after the
/// seeds are loaded. Later rows are pseudorandom. The search is exact: it enumerates the states of the generator and
/// stops when every taxel has a seed.
///
/// ```
/// use spts_circuit::{WeightMode, Weights, parse_patterns, seeds_of_first_window};
///
/// let wanted = parse_patterns("++-\n-+-\n---\n+-+")?;
/// let weights = Weights::with_seeds(WeightMode::Binary, seeds_of_first_window(&wanted)?)?;
/// assert_eq!([0, 1, 2, 3].map(|row| weights.level(0, row)), [1.0, -1.0, -1.0, 1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Refusal`] for more than 24 rows, or levels other than ±1.
pub fn seeds_of_first_window(window: &Patterns) -> Result<Vec<u32>, Refusal> {
    let rows = window.period();
    if rows > MOST_ROWS {
        return Err(Refusal::new(format!("a window of {rows} rows is outside [1, {MOST_ROWS}]")));
    }
    let words = words(window)?;
    let mut seeds: BTreeMap<u32, u32> = words.iter().map(|word| (*word, 0)).collect();
    let mut wanted = vec![0_u64; (1_usize << rows).div_ceil(64)];
    for word in seeds.keys() {
        wanted[*word as usize / 64] |= 1 << (word % 64);
    }
    let mut left = seeds.len();
    let mask = (1_u32 << rows) - 1;
    // the sequence is a cycle: so many steps on is M steps back
    let back = Jump::new(STATES - rows as u64);
    let (mut state, mut word) = (0, 0);
    for step in 1.. {
        if left == 0 {
            break;
        }
        state = Jump::ONE.apply(state);
        word = (word << 1 | state >> 31) & mask;
        let bits = &mut wanted[word as usize / 64];
        if *bits >> (word % 64) & 1 == 1 && step >= rows {
            *bits &= !(1 << (word % 64));
            seeds.insert(word, back.apply(state));
            left -= 1;
        }
    }
    Ok(words.iter().map(|word| seeds[word]).collect())
}

/// Levels of every taxel, the one of row 0 in the highest bit.
fn words(window: &Patterns) -> Result<Vec<u32>, Refusal> {
    let mut words = vec![0; window.taxels()];
    for row in 0..window.period() {
        for (taxel, (word, &code)) in words.iter_mut().zip(window.row(row as u64)).enumerate() {
            if !matches!(code, 0 | 255) {
                let found = format!("row {row}, taxel {taxel}: code {code}");
                let needed = "0 or 255, what a generator puts out in binary mode";
                return Err(Refusal::new(format!("{found} is not {needed}")));
            }
            *word = *word << 1 | u32::from(code > 0);
        }
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every level that a sound cell has is the level of the code that it stands for, bit for bit.
    #[test]
    fn codes_and_levels_are_inverse() {
        for mode in [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary] {
            let weights = Weights::new(mode, Seeding::Address, 100);
            for row in 0..100 {
                let level = weights.level(31, row);
                assert_eq!(mode.code_level(code_of(level)).to_bits(), level.to_bits(), "{mode:?}");
            }
            for code in 0..=u8::MAX {
                assert_eq!(code_of(mode.code_level(code)), code, "{mode:?}");
            }
        }
    }

    /// Every way to ask for the rows of three wires gives the same, and each wire's own rows are those of its taxels.
    #[test]
    fn several_wires_are_woven() {
        let layout = spts_models::SkinLayout::new(5, 4, 5e-3, 3e-3).unwrap();
        let config = crate::WireConfig { round_robin: Some(3), ..Default::default() };
        let wires = Wires::new(&[config], &layout).unwrap();
        let patterns = Patterns::new(2, (0..40).map(|k| if k * k % 7 < 3 { 255 } else { 0 }).collect()).unwrap();
        let seeds: Vec<u32> = (0..20).map(|k| k * 77 + 5).collect();
        for weights in [
            Weights::new(WeightMode::Binary, Seeding::Mixed, 20),
            Weights::new(WeightMode::Analog, Seeding::Address, 20),
            Weights::new(WeightMode::Raster, Seeding::Address, 20),
            Weights::with_seeds(WeightMode::Binary, seeds).unwrap(),
            Weights::with_patterns(WeightMode::Binary, patterns).unwrap(),
        ] {
            let weights = weights.wired(wires.clone()).unwrap();
            let wires = weights.wires().unwrap();
            let (first, len) = (100, 47);
            let rows = WeightRows::new(&weights, first, len);
            let phi = rows.to_vec();
            let values: Vec<f64> = (0..20).map(|k| f64::from(k).cos()).collect();
            let mut sums = vec![0.0; len];
            weights.weighted_sums(first, &values, &mut sums);
            let mut seen = [0, 1, 2].map(|wire| weights.before(wire, first));
            for (i, (row, sum)) in phi.chunks(20).zip(&sums).enumerate() {
                let at = first + i as u64;
                let expected: f64 = row.iter().zip(&values).map(|(w, v)| w * v).sum();
                assert!((sum - expected).abs() < 1e-12);
                let raster = weights.mode() == WeightMode::Raster;
                let place = usize::try_from(at).unwrap();
                let wire = if raster { wires.of(place % 20) } else { place % 3 };
                assert!(raster || rows.wire(i) == wire);
                let own = weights.of_wire(wire);
                for k in 0..20_u32 {
                    let mut places = (0_u32..).zip(wires.taxels(wire));
                    let place = places.find(|(_, own)| **own == k);
                    let level = place.map_or(0.0, |(place, _)| own.level(place, seen[wire]));
                    assert_eq!(row[k as usize].to_bits(), level.to_bits(), "{:?}, row {at}, taxel {k}", weights.mode());
                    assert_eq!(weights.level(k, at).to_bits(), level.to_bits());
                }
                seen[wire] += 1;
            }
            assert_eq!(seen, [0, 1, 2].map(|wire| weights.before(wire, first + len as u64)));
            let Some(bits) = rows.sign_bits() else { continue };
            for (i, row) in phi.chunks(20).enumerate() {
                assert!(row.iter().enumerate().all(|(k, w)| (bits[i] >> k & 1 == 1) == (*w > 0.0)));
            }
        }
        assert!(Weights::new(WeightMode::Binary, Seeding::Mixed, 21).wired(wires).is_err());
    }

    const DEVICE: [WeightMode; 3] = [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary];

    #[test]
    fn a_skin_without_taxels_has_no_weights() {
        for mode in DEVICE {
            let weights = Weights::new(mode, Seeding::Address, 0);
            let mut sums = [f64::NAN; 3];
            weights.weighted_sums(7, &[], &mut sums);
            assert!(sums.iter().all(|sum| sum.abs() < f64::MIN_POSITIVE), "{mode:?}");
            weights.fill_rows(7, &mut []);
            assert!(weights.level(0, 7).abs() <= 1.0);
        }
        assert!(Weights::new(WeightMode::Raster, Seeding::Address, 0).level(0, 0).abs() < f64::MIN_POSITIVE);
    }

    proptest! {
        #[test]
        fn levels_of_a_taxel_are_its_column(first in 0_u64..1_000_000_000_000, taxels in 1_u32..130) {
            for mode in DEVICE {
                let weights = Weights::new(mode, Seeding::Mixed, taxels);
                let (taxel, mut column) = (taxels / 2, [f64::NAN; 9]);
                weights.fill_levels(taxel, first, &mut column);
                let expected: Vec<f64> = (first..first + 9).map(|row| weights.level(taxel, row)).collect();
                prop_assert_eq!(column.to_vec(), expected);
            }
        }
    }

    fn codes(weights: &Weights, rows: usize) -> Vec<u8> {
        let mut codes = vec![0; rows * weights.taxels()];
        weights.fill_codes(0, &mut codes);
        codes
    }

    /// Windows of another kind than a generator's: of a square wave a taxel.
    #[test]
    fn the_seeds_give_the_window() {
        for rows in [1, 2, 20, 24] {
            let taxels = 50;
            let high = |k: usize| (k / taxels + k % taxels) / (1 + k % 7) % 2 == 1;
            let wanted: Vec<u8> = (0..rows * taxels).map(|k| if high(k) { 255 } else { 0 }).collect();
            let seeds = seeds_of_first_window(&Patterns::new(rows, wanted.clone()).unwrap()).unwrap();
            let weights = Weights::with_seeds(WeightMode::Binary, seeds).unwrap();
            assert_eq!(codes(&weights, rows), wanted, "{rows} rows");
        }
    }

    #[test]
    fn windows_that_cannot_be_are_refused() {
        let refused = |rows, codes: Vec<u8>| seeds_of_first_window(&Patterns::new(rows, codes).unwrap()).unwrap_err();
        assert_eq!(refused(25, vec![0; 25]).to_string(), "a window of 25 rows is outside [1, 24]");
        let said = refused(2, vec![0, 0, 0, 1]).to_string();
        assert!(said.starts_with("row 1, taxel 1: code 1 is not 0 or 255"), "{said}");
    }

    /// The search ends for any window.
    #[test]
    fn every_window_is_in_the_sequence() {
        let (mut seen, mut left) = (vec![0_u64; 1 << (MOST_ROWS - 6)], 1_u32 << MOST_ROWS);
        let (mut state, mut word, mut step) = (0, 0_u32, 0_usize);
        while left > 0 {
            state = Jump::ONE.apply(state);
            word = (word << 1 | state >> 31) & ((1 << MOST_ROWS) - 1);
            step += 1;
            let bits = &mut seen[word as usize / 64];
            if step >= MOST_ROWS && *bits >> (word % 64) & 1 == 0 {
                *bits |= 1 << (word % 64);
                left -= 1;
            }
        }
        assert_eq!(step, 271_551_075);
    }
}
