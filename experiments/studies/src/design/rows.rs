//! Rows of the sensing matrix of a design.

use super::wire::too_many_taxels;
use serde::{Deserialize, Serialize};
use spts_circuit::{Patterns, Seeding, WeightMode, Weights};
use spts_input::Refusal;
use spts_recon::matrix_free::SheetPrior;
use spts_recon::rows::{Expected, RowTask, designer};
use std::ops::Range;

/// Most rows that a cell holds as a pattern.
pub(super) const PATTERN_ROWS: usize = spts_firmware::PATTERN_BITS;
/// `greedy` is asked on wires of so many taxels at most: its time grows with their square.
const GREEDY_TAXELS: usize = 256;

/// Where the rows of a designed skin come from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowSource {
    /// Pseudorandom signs of the cells' generators, seeded with a 32-bit mix of their addresses.
    Generator,
    /// Rows by the named designer, stored in the cells as a pattern of at most 64 rows.
    Designer(String),
}

impl RowSource {
    /// Name in tables and figures.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Generator => "random",
            Self::Designer(name) => name,
        }
    }

    /// All sources that are worth a look on wires of `taxels` taxels.
    pub(super) fn candidates(taxels: usize) -> Vec<Self> {
        let designed = |name: &str| Self::Designer(name.to_owned());
        let mut sources = vec![Self::Generator, designed("cosine_signs")];
        if taxels <= GREEDY_TAXELS {
            sources.push(designed("greedy"));
        }
        sources
    }

    /// Most rows there are, for a wire of `taxels` taxels.
    pub(super) fn most_rows(&self, taxels: usize) -> usize {
        match self {
            Self::Generator => usize::MAX,
            Self::Designer(_) => PATTERN_ROWS.min(taxels),
        }
    }
}

/// Rows of all wires, each of which reads a band of the skin's rows.
#[derive(Debug, Clone)]
pub(super) struct BandRows {
    /// Columns of the skin.
    cols: usize,
    /// Rows of the skin that belong to each wire.
    pub(super) bands: Vec<Range<usize>>,
    /// Weights of every wire.
    pub(super) weights: Vec<Weights>,
}

/// The skin's rows of each of `wires` wires: bands whose heights differ by one at most, the highest first.
pub(super) fn bands(rows: usize, wires: usize) -> Vec<Range<usize>> {
    let (height, rest) = (rows / wires, rows % wires);
    let start = |wire: usize| wire * height + wire.min(rest);
    (0..wires).map(|wire| start(wire)..start(wire + 1)).collect()
}

impl BandRows {
    /// `measurements` rows of `source` for every wire; a generator has as many as are asked for.
    pub(super) fn new(
        source: &RowSource,
        prior: &SheetPrior,
        wires: usize,
        measurements: usize,
        seed: u64,
    ) -> Result<Self, Refusal> {
        let [rows, cols] = prior.shape();
        let bands = bands(rows, wires);
        match source {
            RowSource::Generator => Self::generator(bands, cols),
            RowSource::Designer(name) => {
                let height = bands.first().map_or(0, Range::len);
                let expected = Expected::smooth([height, cols], length(prior)).map_err(Refusal::from_error)?;
                let task = RowTask {
                    seed,
                    ..RowTask::new(measurements, &expected)
                };
                let found = designer(name).ok_or_else(|| Refusal::new(format!("rows: no designer {name:?}")))?;
                let matrix = (found.build)().design(&task).map_err(Refusal::from_error)?;
                let signs = (0..matrix.nrows()).flat_map(|r| matrix.row(r).to_vec());
                let codes = signs.map(|v| if v > 0.0 { u8::MAX } else { 0 }).collect();
                Self::pattern(
                    &Patterns::new(matrix.nrows(), codes).map_err(Refusal::from_error)?,
                    bands,
                    cols,
                )
            }
        }
    }

    /// Every wire with the same generators.
    fn generator(bands: Vec<Range<usize>>, cols: usize) -> Result<Self, Refusal> {
        let weights = bands.iter().map(|band| -> Result<Weights, Refusal> {
            let taxels = u32::try_from(band.len() * cols).map_err(too_many_taxels)?;
            Ok(Weights::new(WeightMode::Binary, Seeding::Mixed, taxels))
        });
        Ok(Self {
            cols,
            weights: weights.collect::<Result<_, _>>()?,
            bands,
        })
    }

    /// Every wire with the same pattern, that of the highest band; a band that is a row lower has its first taxels.
    pub(super) fn pattern(pattern: &Patterns, bands: Vec<Range<usize>>, cols: usize) -> Result<Self, Refusal> {
        let weights = bands.iter().map(|band| -> Result<Weights, Refusal> {
            let rows = (0..pattern.period() as u64).flat_map(|row| {
                let codes = pattern.row(row);
                codes[..codes.len().min(band.len() * cols)].to_vec()
            });
            let patterns = Patterns::new(pattern.period(), rows.collect()).map_err(Refusal::from_error)?;
            Ok(Weights::with_patterns(WeightMode::Binary, patterns).map_err(Refusal::from_error)?)
        });
        Ok(Self {
            cols,
            weights: weights.collect::<Result<_, _>>()?,
            bands,
        })
    }

    /// The pattern of the highest band, if it is one.
    pub(super) fn text(&self) -> Option<String> {
        self.weights.first()?.patterns().map(Patterns::to_text)
    }

    /// Measurements `range` of every wire as rows over all taxels, those of one measurement after another, with the
    /// wire of each.
    pub(super) fn rows(&self, range: Range<usize>) -> (Vec<f64>, Vec<usize>) {
        let taxels = self.cols * self.bands.last().map_or(0, |band| band.end);
        let count = range.len() * self.bands.len();
        let (mut rows, mut wires) = (vec![0.0; count * taxels], Vec::with_capacity(count));
        let mut out = rows.chunks_exact_mut(taxels.max(1));
        for measurement in range {
            for (wire, (band, weights)) in self.bands.iter().zip(&self.weights).enumerate() {
                if let Some(row) = out.next() {
                    weights.fill_rows(
                        measurement as u64,
                        &mut row[band.start * self.cols..band.end * self.cols],
                    );
                }
                wires.push(wire);
            }
        }
        (rows, wires)
    }
}

/// Length over which images are smooth whose neighbours have the prior's covariance, taxels: that of exp(−d²/2ℓ²).
fn length(prior: &SheetPrior) -> f64 {
    let [rows, cols] = prior.shape();
    let neighbour = if cols > 1 {
        1
    } else if rows > 1 {
        cols
    } else {
        return SHORTEST;
    };
    let covariance = prior.covariance(0, neighbour).clamp(0.0, 0.999);
    (-0.5 / covariance.ln()).sqrt().max(SHORTEST)
}

/// Images of single taxels.
const SHORTEST: f64 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_the_skin() {
        assert_eq!(bands(10, 3), [0..4, 4..7, 7..10]);
        assert_eq!(bands(4, 4).len(), 4);
    }

    /// Rows of a wire are its weights on its own band and nothing elsewhere.
    #[test]
    fn rows_of_wires_do_not_overlap() {
        let prior = SheetPrior::smooth([5, 4], 1.0).unwrap();
        for source in RowSource::candidates(8) {
            let rows = BandRows::new(&source, &prior, 2, 6, 1).unwrap();
            let (values, wires) = rows.rows(2..4);
            assert_eq!(wires, [0, 1, 0, 1]);
            for (row, wire) in values.chunks(20).zip(wires) {
                for (k, v) in row.iter().enumerate() {
                    let own = (k / 4 < 3) == (wire == 0);
                    assert!((v.abs() - if own { 1.0 } else { 0.0 }).abs() < 1e-15);
                }
            }
            let mut first = vec![0.0; 12];
            rows.weights[0].fill_rows(2, &mut first);
            assert_eq!(values[..12], first);
            assert_eq!(rows.text().is_some(), source != RowSource::Generator);
        }
    }

    #[test]
    fn lengths_are_those_of_smooth_priors() {
        let prior = SheetPrior::smooth([5, 4], 1.7).unwrap();
        // the floor of the prior takes a thousandth of a covariance of .84
        assert!((length(&prior) - 1.7).abs() < 0.02);
    }
}
