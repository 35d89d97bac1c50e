//! Images from few rows of ±1, the same in every frame.

use super::error::ReadoutsError;
use super::readout::{PreparedReadout, Reading, ReadoutSkin, until_noticed};
use super::rows::StoredRows;
use super::wire::HeldWire;
use spts_eval::training::TrainingData;
use spts_recon::Matrix;
use spts_recon::matrix_free::RegionPursuit;
use spts_recon::operator::{Centred, LinearOperator, SelectColumns, centre};
use spts_recon::recover::{Fixed, Noise};
use std::sync::Arc;

/// Contact noise and what a prior misses, as a share of the root mean square of the samples: as on the board.
const NOISE: Noise = Noise::Relative(0.12);
/// Levels of the cells' converters by their data sheet, of which the gains are computed.
const MAX_ROUNDS: usize = 10;

/// What the rows are like, which decides how large skins are decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rows {
    /// Pseudorandom.
    Random,
    /// Designed.
    Designed,
}

/// Few rows, measured once a touch: a number of measurements M is the first M of them.
pub(super) struct FewRows {
    rows: StoredRows,
    shape: [usize; 2],
    decoders: Vec<(usize, Decoder)>,
}

/// How the image is found.
enum Decoder {
    /// The most probable non-negative image under a prior, `nn_lmmse`; and the root mean square of the sums that the prior
    /// expects.
    Gaussian(Box<Fixed>, f64),
    /// Smooth patches, found and solved for.
    Patches,
}

impl FewRows {
    pub(super) fn new(skin: &ReadoutSkin, rows: StoredRows, _kind: Rows) -> Result<Self, ReadoutsError> {
        let taxels = rows.taxels();
        let mut decoders = Vec::new();
        for count in skin.measurements() {
            let decoder = if taxels <= TrainingData::MOST_TAXELS {
                let prior = skin.prior()?;
                let values: Vec<f64> = (0..count).flat_map(|r| rows.row(r)).map(|w| f64::from(*w)).collect();
                let matrix = Matrix::from_rows(count, taxels, values).unwrap_or_else(|_| Matrix::zeros(count, taxels));
                let covariance = prior.covariance();
                let square: f64 = (0..count)
                    .map(|r| {
                        let row = matrix.row(r);
                        let mut product = vec![0.0; taxels];
                        covariance.apply(row, &mut product);
                        row.iter().zip(&product).map(|(a, b)| a * b).sum::<f64>()
                    })
                    .sum();
                let expected = (square / count as f64).sqrt();
                Decoder::Gaussian(Box::new(Fixed::new(matrix.view(), Arc::clone(&prior), NOISE)?), expected)
            } else {
                Decoder::Patches
            };
            decoders.push((count, decoder));
        }
        Ok(Self {
            rows,
            shape: [skin.layout.rows(), skin.layout.cols()],
            decoders,
        })
    }

    /// The image that the first samples show.
    fn image(&self, decoder: &Decoder, samples: &[f64]) -> Result<Vec<f64>, ReadoutsError> {
        match decoder {
            Decoder::Gaussian(fixed, expected) => {
                let rms = (samples.iter().map(|v| v * v).sum::<f64>() / samples.len() as f64).sqrt();
                let mut window = fixed.window();
                samples.iter().for_each(|v| window.push(v * expected / rms.max(f64::MIN_POSITIVE)));
                Ok(window.non_negative()?.to_vec())
            }
            Decoder::Patches => {
                let [rows, cols] = self.shape;
                let pursuit = RegionPursuit {
                    max_rounds: MAX_ROUNDS,
                    ..RegionPursuit::new(rows, cols)
                };
                let phi = Centred::new(FirstRows {
                    rows: &self.rows,
                    count: samples.len(),
                });
                let mut centred = samples.to_vec();
                centre(&mut centred);
                Ok(pursuit.recover(&phi, &centred, None)?.image)
            }
        }
    }
}

impl PreparedReadout for FewRows {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sums = self.rows.sums(conductance_s);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, ReadoutsError> {
        let [low, high] = wire.levels();
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let frame = wire.signs(&self.rows, self.rows.len())?;
        let samples: Vec<f64> = frame.volts.iter().map(|v| v / half).collect();
        let beyond: Vec<bool> = frame.volts.iter().map(|v| v.abs() > frame.alarm_v).collect();
        let read = |(count, decoder): &(usize, Decoder)| {
            let first = &samples[..*count];
            let mut image = self.image(decoder, first)?;
            if matches!(decoder, Decoder::Gaussian(..)) {
                // what the middle of the levels adds with all that is pressed, from the image of the first pass
                let mut lesser = first.to_vec();
                let share = self.sum_of(&image, first) * middle / half;
                lesser.iter_mut().for_each(|v| *v -= share);
                image = self.image(decoder, &lesser)?;
            }
            Ok(Reading {
                measurements: *count,
                image,
                noticed: until_noticed(&beyond[..*count]),
                placed: Some(*count as f64 - 0.5),
            })
        };
        self.decoders.iter().map(read).collect()
    }
}

impl FewRows {
    /// Σ of the image in the unit of the samples: the factor between the two is that of least squares.
    fn sum_of(&self, image: &[f64], samples: &[f64]) -> f64 {
        let phi = FirstRows {
            rows: &self.rows,
            count: samples.len(),
        };
        let mut sums = vec![0.0; samples.len()];
        phi.apply(image, &mut sums);
        let square: f64 = sums.iter().map(|s| s * s).sum();
        let product: f64 = sums.iter().zip(samples).map(|(s, y)| s * y).sum();
        image.iter().sum::<f64>() * product / square.max(f64::MIN_POSITIVE)
    }
}

/// The first rows of stored signs, as an operator.
#[derive(Clone)]
struct FirstRows<'a> {
    rows: &'a StoredRows,
    count: usize,
}

impl LinearOperator for FirstRows<'_> {
    fn nrows(&self) -> usize {
        self.count
    }

    fn ncols(&self) -> usize {
        self.rows.taxels()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        let used: Vec<(usize, f64)> = x.iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect();
        for (r, y) in y.iter_mut().enumerate() {
            let row = self.rows.row(r);
            *y = used.iter().map(|(k, x)| f64::from(row[*k]) * x).sum();
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        for (r, y) in y.iter().enumerate() {
            x.iter_mut().zip(self.rows.row(r)).for_each(|(x, w)| *x += f64::from(*w) * y);
        }
    }
}

impl SelectColumns for FirstRows<'_> {
    type Selected = Matrix;

    fn select_columns(&self, columns: &[usize]) -> Matrix {
        let mut selected = Matrix::zeros(self.count, columns.len());
        for r in 0..self.count {
            let row = self.rows.row(r);
            selected.row_mut(r).iter_mut().zip(columns).for_each(|(out, k)| *out = f64::from(row[*k]));
        }
        selected
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        variance.fill(r.iter().map(|r| r * r).sum());
    }
}
