//! Decodes images from few rows of ±1 that are the same in every frame.

use super::wire::WireSession;
use super::{Reading, ReadoutSkin, WireReadout};
use spts_circuit::Patterns;
use spts_input::Refusal;
use spts_recon::matrix_free::{RegionPursuit, SheetDecoder, SheetNoise, SheetPrior};
use spts_recon::operator::{Centred, LinearOperator as _, SelectColumns as _, centre};
use spts_recon::recover::{Fixed, FixedWindow, Noise};
use spts_recon::{Matrix, MatrixView};

/// Contact noise and what a prior misses, as a share of the root mean square of the samples: as on the board.
const NOISE: Noise = Noise::Relative(0.12);
/// Rounds of a pursuit.
const MAX_ROUNDS: usize = 10;
/// Most taxels that the estimate of a large sheet solves for.
const MOST_PLACES: usize = 256;
/// Most taxels that are decoded under a prior of whole images.
pub(super) const WHOLE_IMAGES: usize = 400;

/// Few rows of ±1, measured once a touch: a number of measurements M is the first M of them.
pub(super) struct FewRows {
    rows: Matrix,
    /// The same for the cells.
    codes: Patterns,
    shape: [usize; 2],
    counts: Vec<usize>,
    decoder: Decoder,
}

/// How the image is found.
enum Decoder {
    /// For each number of measurements, the most probable non-negative image under a prior, `nn_lmmse`; and the root
    /// mean square of the sums expected under the prior.
    Gaussian(Vec<(Fixed, f64)>),
    /// Patches found by [`RegionPursuit`]; then their taxels are solved for.
    Patches,
    /// The non-negative estimate of smooth images, on the taxels with the largest linear estimates.
    Sheet(Box<SheetDecoder>),
}

/// The estimate under the skin's prior from `rows`.
fn gaussian(skin: &ReadoutSkin, rows: MatrixView<'_>) -> Result<(Fixed, f64), Refusal> {
    let prior = skin.prior()?;
    let (mut product, mut square) = (vec![0.0; rows.ncols()], 0.0);
    for row in rows.values().chunks_exact(rows.ncols()) {
        prior.covariance().apply(row, &mut product);
        square += row.iter().zip(&product).map(|(a, b)| a * b).sum::<f64>() / rows.nrows() as f64;
    }
    Ok((Fixed::new(rows, prior, NOISE)?, square.sqrt()))
}

impl FewRows {
    /// The readout with these `rows`. On skins of more than [`WHOLE_IMAGES`] taxels, images are smooth over the
    /// distance `smooth`, taxels, where the rows are made for that; else contacts are found as patches.
    pub(super) fn new(skin: &ReadoutSkin, rows: Matrix, smooth: Option<f64>) -> Result<Self, Refusal> {
        let (shape, counts) = ([skin.layout.rows(), skin.layout.cols()], skin.measurements());
        let decoder = match smooth {
            _ if rows.ncols() <= WHOLE_IMAGES => {
                let each = counts.iter().map(|count| gaussian(skin, rows.view().rows(0, *count)));
                Decoder::Gaussian(each.collect::<Result<_, _>>()?)
            }
            None => Decoder::Patches,
            Some(length) => {
                let mut sheet = SheetDecoder::new(SheetPrior::smooth(shape, length)?, SheetNoise::default(), 1)?;
                sheet.extend(rows.view().values(), &vec![0; rows.nrows()])?;
                Decoder::Sheet(Box::new(sheet))
            }
        };
        Ok(Self { codes: Patterns::of_levels(rows.nrows(), rows.view().values())?, rows, shape, counts, decoder })
    }

    /// Patches that the first samples show. Where there are measurements enough to tell their taxels apart, these are
    /// solved for: a pursuit's bumps are wider than a taxel.
    fn patches(&self, phi: MatrixView<'_>, samples: &[f64]) -> Result<Vec<f64>, Refusal> {
        let [rows, cols] = self.shape;
        let pursuit = RegionPursuit { max_rounds: MAX_ROUNDS, ..RegionPursuit::new(rows, cols) };
        let mut centred = samples.to_vec();
        centre(&mut centred);
        let mut image = pursuit.recover(&Centred::new(phi), &centred, None)?.image;
        if let Some(taxels) = contact_taxels(&image, samples.len()) {
            let mut columns = phi.select_columns(&taxels);
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

impl WireReadout for FewRows {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let mut sums = vec![0.0; self.rows.nrows()];
        self.rows.apply(conductance_s, &mut sums);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut WireSession<'_>) -> Result<Vec<Reading>, Refusal> {
        let [low, high] = wire.levels;
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let frame = wire.signs(&self.codes, self.rows.nrows())?;
        let samples: Vec<f64> = frame.volts.iter().map(|v| v / half).collect();
        let read = |(k, &count): (usize, &usize)| {
            let (phi, first) = (self.rows.view().rows(0, count), &samples[..count]);
            let image = match &self.decoder {
                Decoder::Patches => self.patches(phi, first)?,
                // three quarters as many as measurements, as in `spts design`, and no more than any touch covers
                Decoder::Sheet(sheet) => sheet.non_negative(first, (3 * count / 4).clamp(4, MOST_PLACES))?,
                Decoder::Gaussian(each) => {
                    let (fixed, expected) = &each[k];
                    // what the middle of the levels adds with all that is pressed, from a first image
                    let rough = sum_of(window(fixed, *expected, first).image()?, phi, first);
                    let share = rough * middle / half;
                    let lesser: Vec<f64> = first.iter().map(|v| v - share).collect();
                    window(fixed, *expected, &lesser).non_negative()?.to_vec()
                }
            };
            Ok(Reading { measurements: count, image, noticed: frame.noticed(count), placed: Some(count as f64 - 0.5) })
        };
        self.counts.iter().enumerate().map(read).collect()
    }
}

/// The samples with the root mean square that is `expected` of them.
fn window<'a>(fixed: &'a Fixed, expected: f64, samples: &[f64]) -> FixedWindow<'a> {
    let rms = (samples.iter().map(|v| v * v).sum::<f64>() / samples.len() as f64).sqrt();
    let mut window = fixed.window();
    for v in samples {
        window.push(v * expected / rms.max(f64::MIN_POSITIVE));
    }
    window
}

/// Σ of the image in the unit of the samples: the factor between the two is that of least squares.
fn sum_of(image: &[f64], phi: MatrixView<'_>, samples: &[f64]) -> f64 {
    let mut sums = vec![0.0; samples.len()];
    phi.apply(image, &mut sums);
    let square: f64 = sums.iter().map(|s| s * s).sum();
    let product: f64 = sums.iter().zip(samples).map(|(s, y)| s * y).sum();
    image.iter().sum::<f64>() * product / square.max(f64::MIN_POSITIVE)
}

/// Takes the mean off every column.
fn without_means(columns: &mut Matrix) {
    let (rows, sums) = (columns.nrows(), columns.column_sums());
    for r in 0..rows {
        let row = columns.row_mut(r);
        row.iter_mut().zip(&sums).for_each(|(v, sum)| *v -= sum / rows as f64);
    }
}

/// Taxels count as part of a contact from this share of the image's maximum on: half the share of a support.
const PART: f64 = 0.1;
/// Measurements a taxel at least: with fewer, smoothness has to do.
const MEASUREMENTS_A_TAXEL: usize = 2;
/// Sweeps of the coordinate descent.
const SWEEPS: usize = 100;

/// The taxels that belong to the contacts of `image`, when `measurements` are enough to tell them apart.
fn contact_taxels(image: &[f64], measurements: usize) -> Option<Vec<usize>> {
    let least = PART * image.iter().copied().fold(0.0, f64::max);
    let taxels: Vec<usize> = (0..image.len()).filter(|k| image[*k] > least).collect();
    (!taxels.is_empty() && MEASUREMENTS_A_TAXEL * taxels.len() <= measurements).then_some(taxels)
}

/// The x ≥ 0 with the least ‖`columns` x − y‖, from `start` on: coordinate descent on the normal equations, in the
/// order of the columns. Source: V. Franc, V. Hlaváč, M. Navara, CAIP 2005, "Sequential coordinate-wise algorithm".
fn non_negative(columns: &Matrix, y: &[f64], start: &[f64]) -> Vec<f64> {
    let n = columns.ncols();
    let columns: Vec<Vec<f64>> = (0..n).map(|k| columns.column(k)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gram: Vec<f64> = (0..n * n).map(|e| dot(&columns[e / n], &columns[e % n])).collect();
    let mut x: Vec<f64> = start.iter().map(|v| v.max(0.0)).collect();
    // gradient of half the square
    let mut gradient: Vec<f64> = (0..n).map(|k| dot(&gram[k * n..(k + 1) * n], &x) - dot(&columns[k], y)).collect();
    for _ in 0..SWEEPS {
        for k in 0..n {
            let diagonal = gram[k * n + k];
            if diagonal <= 0.0 {
                continue;
            }
            let step = (x[k] - gradient[k] / diagonal).max(0.0) - x[k];
            if step != 0.0 {
                x[k] += step;
                gradient.iter_mut().zip(&gram[k * n..(k + 1) * n]).for_each(|(g, a)| *g += step * a);
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
