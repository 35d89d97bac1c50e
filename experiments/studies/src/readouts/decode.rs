//! Decodes images from few rows of ±1 that are the same in every frame.

use super::wire::WireSession;
use super::{Reading, ReadoutSkin, WireReadout};
use spts_circuit::Patterns;
use spts_input::Refusal;
use spts_recon::matrix_free::{Patches, SheetDecoder, SheetNoise, SheetPrior};
use spts_recon::operator::LinearOperator as _;
use spts_recon::recover::{Fixed, FixedWindow, Noise};
use spts_recon::{Matrix, MatrixView};

/// Contact noise and what a prior misses, as a share of the root mean square of the samples: as on the board.
const NOISE: Noise = Noise::Relative(0.12);
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
    /// [`Patches`].
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
                Decoder::Patches => Patches::new(self.shape[0], self.shape[1]).recover(phi, first, &[])?,
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
