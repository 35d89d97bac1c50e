//! Decodes images from few rows of ±1 that are the same in every frame.

use super::rows::StoredRows;
use super::wire::HeldWire;
use super::{PreparedReadout, Reading, ReadoutSkin, until_noticed};
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::matrix_free::{RegionPursuit, SheetDecoder, SheetNoise, SheetPrior};
use spts_recon::operator::{Centred, LinearOperator, SelectColumns, centre};
use spts_recon::recover::{Fixed, Noise};
use std::sync::Arc;

/// Contact noise and what a prior misses, as a share of the root mean square of the samples: as on the board.
const NOISE: Noise = Noise::Relative(0.12);
/// Rounds of a pursuit.
const MAX_ROUNDS: usize = 10;
/// Most taxels that the estimate of a large sheet solves for.
const MOST_PLACES: usize = 256;
/// Most taxels that are decoded under a prior of whole images.
pub(super) const WHOLE_IMAGES: usize = 400;

/// What the rows are like, which decides how skins of more than [`WHOLE_IMAGES`] taxels are decoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rows {
    /// Pseudorandom; contacts are found as patches.
    Random,
    /// Products of rows along the axes, for images that are smooth over this distance, taxels.
    Smooth(f64),
}

/// Few rows, measured once a touch: a number of measurements M is the first M of them.
pub(super) struct FewRows {
    rows: StoredRows,
    shape: [usize; 2],
    decoders: Vec<(usize, Decoder)>,
}

/// How the image is found.
enum Decoder {
    /// The most probable non-negative image under a prior, `nn_lmmse`; and the root mean square of the sums expected
    /// under the prior.
    Gaussian(Box<Fixed>, f64),
    /// Patches found by [`RegionPursuit`]; then their taxels are solved for.
    Patches,
    /// The non-negative estimate of smooth images, on the given number of taxels with the largest linear estimates.
    Sheet(Arc<SheetDecoder>, usize),
}

/// The estimate under the skin's prior from the first `count` rows.
fn gaussian(skin: &ReadoutSkin, rows: &StoredRows, count: usize) -> Result<Decoder, Refusal> {
    let (prior, taxels) = (skin.prior()?, rows.taxels());
    let mut matrix = Matrix::zeros(count, taxels);
    let (mut product, mut square) = (vec![0.0; taxels], 0.0);
    for r in 0..count {
        let row = matrix.row_mut(r);
        row.iter_mut()
            .zip(rows.row(r))
            .for_each(|(out, w)| *out = f64::from(*w));
        prior.covariance().apply(row, &mut product);
        square += row.iter().zip(&product).map(|(a, b)| a * b).sum::<f64>() / count as f64;
    }
    let fixed = Fixed::new(matrix.view(), prior, NOISE)?;
    Ok(Decoder::Gaussian(Box::new(fixed), square.sqrt()))
}

/// The decoder of a large sheet on which images are alike over `length` taxels, its rows prepared.
fn sheet(rows: &StoredRows, shape: [usize; 2], length: f64) -> Result<SheetDecoder, Refusal> {
    let mut decoder = SheetDecoder::new(SheetPrior::smooth(shape, length)?, SheetNoise::default(), 1)?;
    let levels: Vec<f64> = (0..rows.len())
        .flat_map(|r| rows.row(r).iter().map(|w| f64::from(*w)))
        .collect();
    decoder.extend(&levels, &vec![0; rows.len()])?;
    Ok(decoder)
}

/// Taxels that are solved for with `count` measurements: three quarters as many, as in `spts design`, and no more than
/// any of the touches covers.
fn places(count: usize) -> usize {
    (3 * count / 4).clamp(4, MOST_PLACES)
}

impl FewRows {
    pub(super) fn new(skin: &ReadoutSkin, rows: StoredRows, kind: Rows) -> Result<Self, Refusal> {
        let (taxels, shape) = (rows.taxels(), [skin.layout.rows(), skin.layout.cols()]);
        let sheet = match kind {
            Rows::Smooth(length) if taxels > WHOLE_IMAGES => Some(Arc::new(sheet(&rows, shape, length)?)),
            _ => None,
        };
        let mut decoders = Vec::new();
        for count in skin.measurements() {
            let decoder = match &sheet {
                _ if taxels <= WHOLE_IMAGES => gaussian(skin, &rows, count)?,
                None => Decoder::Patches,
                Some(sheet) => Decoder::Sheet(Arc::clone(sheet), places(count)),
            };
            decoders.push((count, decoder));
        }
        Ok(Self { rows, shape, decoders })
    }

    /// The image that the first samples show; where it takes time to keep it from being negative, not yet so if
    /// `quick`.
    fn image(&self, decoder: &Decoder, samples: &[f64], quick: bool) -> Result<Vec<f64>, Refusal> {
        match decoder {
            Decoder::Gaussian(fixed, expected) => {
                let rms = (samples.iter().map(|v| v * v).sum::<f64>() / samples.len() as f64).sqrt();
                let mut window = fixed.window();
                samples
                    .iter()
                    .for_each(|v| window.push(v * expected / rms.max(f64::MIN_POSITIVE)));
                Ok(if quick {
                    window.image()?.to_vec()
                } else {
                    window.non_negative()?.to_vec()
                })
            }
            Decoder::Sheet(sheet, places) => Ok(sheet.non_negative(samples, *places)?),
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
                let mut image = pursuit.recover(&phi, &centred, None)?.image;
                // a pursuit's bumps are wider than a taxel
                if let Some(taxels) = contact_taxels(&image, samples.len()) {
                    let mut columns = phi.inner().select_columns(&taxels);
                    without_means(&mut columns);
                    let start: Vec<f64> = taxels.iter().map(|k| image[*k]).collect();
                    image.fill(0.0);
                    for (k, v) in taxels.iter().zip(non_negative(&columns, &centred, &start)) {
                        image[*k] = v;
                    }
                }
                Ok(image)
            }
        }
    }
}

impl PreparedReadout for FewRows {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sums = self.rows.sums(conductance_s);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
        let [low, high] = wire.levels();
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let frame = wire.signs(&self.rows, self.rows.len())?;
        let samples: Vec<f64> = frame.volts.iter().map(|v| v / half).collect();
        let beyond: Vec<bool> = frame.volts.iter().map(|v| v.abs() > frame.alarm_v).collect();
        let read = |(count, decoder): &(usize, Decoder)| {
            let first = &samples[..*count];
            let image = if matches!(decoder, Decoder::Patches | Decoder::Sheet(..)) {
                self.image(decoder, first, false)?
            } else {
                // what the middle of the levels adds with all that is pressed, from a first image
                let share = self.sum_of(&self.image(decoder, first, true)?, first) * middle / half;
                let lesser: Vec<f64> = first.iter().map(|v| v - share).collect();
                self.image(decoder, &lesser, false)?
            };
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

/// Takes the mean off every column.
fn without_means(columns: &mut Matrix) {
    let (rows, sums) = (columns.nrows(), columns.column_sums());
    for r in 0..rows {
        let row = columns.row_mut(r);
        row.iter_mut().zip(&sums).for_each(|(v, sum)| *v -= sum / rows as f64);
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
            x.iter_mut()
                .zip(self.rows.row(r))
                .for_each(|(x, w)| *x += f64::from(*w) * y);
        }
    }
}

impl SelectColumns for FirstRows<'_> {
    type Selected = Matrix;

    fn select_columns(&self, columns: &[usize]) -> Matrix {
        let mut selected = Matrix::zeros(self.count, columns.len());
        for r in 0..self.count {
            let row = self.rows.row(r);
            selected
                .row_mut(r)
                .iter_mut()
                .zip(columns)
                .for_each(|(out, k)| *out = f64::from(row[*k]));
        }
        selected
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        variance.fill(r.iter().map(|r| r * r).sum());
    }
}

/// Taxels count as part of a contact from this share of the image's maximum on: half the share of a support.
const PART: f64 = 0.1;
/// Measurements a taxel at least: with fewer, smoothness has to do.
const MEASUREMENTS_A_TAXEL: usize = 2;
/// Sweeps of the coordinate descent.
const SWEEPS: usize = 100;

/// The taxels that belong to the contacts of `image`, when `measurements` are enough to tell them apart.
pub(super) fn contact_taxels(image: &[f64], measurements: usize) -> Option<Vec<usize>> {
    let least = PART * image.iter().copied().fold(0.0, f64::max);
    let taxels: Vec<usize> = (0..image.len()).filter(|k| image[*k] > least).collect();
    (!taxels.is_empty() && MEASUREMENTS_A_TAXEL * taxels.len() <= measurements).then_some(taxels)
}

/// The x ≥ 0 with the least ‖`columns` x − y‖, from `start` on: coordinate descent on the normal equations, in the
/// order of the columns. Source: V. Franc, V. Hlaváč, M. Navara, CAIP 2005, "Sequential coordinate-wise algorithm".
pub(super) fn non_negative(columns: &Matrix, y: &[f64], start: &[f64]) -> Vec<f64> {
    let n = columns.ncols();
    let columns: Vec<Vec<f64>> = (0..n).map(|k| columns.column(k)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gram: Vec<f64> = (0..n * n).map(|e| dot(&columns[e / n], &columns[e % n])).collect();
    let mut x: Vec<f64> = start.iter().map(|v| v.max(0.0)).collect();
    // gradient of half the square
    let mut gradient: Vec<f64> = (0..n)
        .map(|k| dot(&gram[k * n..(k + 1) * n], &x) - dot(&columns[k], y))
        .collect();
    for _ in 0..SWEEPS {
        for k in 0..n {
            let diagonal = gram[k * n + k];
            if diagonal <= 0.0 {
                continue;
            }
            let step = (x[k] - gradient[k] / diagonal).max(0.0) - x[k];
            if step != 0.0 {
                x[k] += step;
                gradient
                    .iter_mut()
                    .zip(&gram[k * n..(k + 1) * n])
                    .for_each(|(g, a)| *g += step * a);
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: of y = (1, −1) the unit columns keep the first; and an exact solution is found where there is one.
    #[test]
    fn the_least_squares_are_not_negative() {
        let unit = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
        let x = non_negative(&unit, &[1.0, -1.0], &[0.0, 5.0]);
        assert!((x[0] - 1.0).abs() < 1e-12 && x[1].abs() < 1e-12, "{x:?}");
        // (2, 0.5) through three rows
        let a = Matrix::from_rows(3, 2, vec![1.0, 1.0, 1.0, -1.0, 1.0, 1.0]).unwrap();
        let x = non_negative(&a, &[2.5, 1.5, 2.5], &[0.0, 0.0]);
        assert!((x[0] - 2.0).abs() < 1e-9 && (x[1] - 0.5).abs() < 1e-9, "{x:?}");
        assert_eq!(contact_taxels(&[0.0, 1.0, 0.05, 0.5], 4), Some(vec![1, 3]));
        assert_eq!(contact_taxels(&[0.0, 1.0, 0.05, 0.5], 3), None);
        assert_eq!(contact_taxels(&[0.0; 4], 3), None);
    }
}
