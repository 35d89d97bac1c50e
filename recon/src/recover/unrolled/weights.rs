//! The numbers that training finds for an unrolled network.

use super::layer::WIDTHS;
use crate::matrix::Matrix;

/// A dense layer of a neural network: out = W u + b for the inputs u.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layer {
    /// W in tiles of outputs, each inputs × width, so that a decode reads it sequentially.
    pub(super) weights: Vec<f32>,
    /// b, one an output.
    pub(super) bias: Vec<f32>,
}

impl Layer {
    /// A layer whose `weights` are the matrix W (inputs × outputs, row-major), with one `bias` b for each output.
    /// [`super::UnrolledWeights::new`] checks that layers fit together.
    #[must_use]
    pub fn new(weights: Vec<f32>, bias: Vec<f32>) -> Self {
        let (outputs, inputs) = (bias.len(), weights.len() / bias.len().max(1));
        let mut tiles = Vec::with_capacity(weights.len());
        let mut first = 0;
        while first < outputs {
            let width = WIDTHS.into_iter().find(|width| first + width <= outputs).unwrap_or(1);
            tiles.extend((0..inputs).flat_map(|i| &weights[i * outputs + first..][..width]));
            first += width;
        }
        // what is no whole number of rows is refused by its length
        tiles.extend_from_slice(&weights[inputs * outputs..]);
        Self { weights: tiles, bias }
    }

    fn check(&self, name: &str, inputs: usize, outputs: usize) -> Result<(), UnrolledError> {
        for (what, len, expected) in [
            ("weights", self.weights.len(), inputs * outputs),
            ("biases", self.bias.len(), outputs),
        ] {
            if len != expected {
                return Err(UnrolledError::Length {
                    what: format!("{what} of {name}"),
                    len,
                    expected,
                });
            }
        }
        if self.weights.iter().chain(&self.bias).all(|w| w.is_finite()) {
            Ok(())
        } else {
            Err(UnrolledError::NotFinite { what: name.to_owned() })
        }
    }
}

/// Parameters of one step of an [`super::Unrolled`] network, by which the step corrects the image: two dense layers,
/// with max(0, ·) between them. The documentation there has the formulas. N is the number of taxels, P that of the
/// values handed from step to step (`memory`), and H that of the hidden values, which is free.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UnrolledStep {
    /// W₁ and b₁: from 4 N + P + 2 inputs (x, Vᵀ e, Vᵀ w/s, v, h, ln(M/20), |e|/√M, in this order) to H hidden values.
    pub hidden: Layer,
    /// W₂ and b₂: from H hidden values to N + P outputs, which are the correction of the N taxels, and then the P
    /// values for the next step.
    pub change: Layer,
}

/// All numbers that training finds for an [`super::Unrolled`] network, whose documentation has the formulas. None of
/// them is a weight of a taxel: those are the rows Φ of the problem.
#[derive(Debug, Clone, PartialEq)]
pub struct UnrolledWeights {
    /// K, second moments of images of length 1, N × N.
    pub(super) prior: Matrix,
    /// ν
    pub(super) noise_variance: f64,
    pub(super) steps: Vec<UnrolledStep>,
    pub(super) output: Layer,
    pub(super) memory: usize,
}

/// Why numbers are not a valid network.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnrolledError {
    /// An array whose length does not match the others.
    #[error("{what} have {len} numbers, expected {expected}")]
    Length {
        /// Name of the array.
        what: String,
        /// Its length.
        len: usize,
        /// Expected length.
        expected: usize,
    },
    /// A NaN or an infinity.
    #[error("{what} have a number that is not finite")]
    NotFinite {
        /// Name of the array.
        what: String,
    },
    /// A number outside its range.
    #[error("`{field}` = {value} is outside {range}")]
    Range {
        /// Its name.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
}

/// Most taxels: the moments of their images take O(N²).
const MOST_TAXELS: usize = 4096;
/// Steps of [`UnrolledWeights::plain`].
const PLAIN_STEPS: usize = 30;
/// Slope of the logarithm of the odds of [`UnrolledWeights::plain`].
const STEEP: f32 = 100.0;
/// Smallest and largest sum of the variances of images of length 1, and of their noise; both are 1 and .01 or so.
const MOMENTS: [f64; 2] = [1e-3, 1e3];

impl UnrolledWeights {
    /// A network of `steps` and an `output` layer. `prior` (N × N) holds the second moments of the images and
    /// `noise_variance` the variance of the noise, both for images of length 1.
    ///
    /// # Errors
    /// [`UnrolledError`] if the layers do not fit together, a number is not finite, or the prior is not valid.
    pub fn new(
        prior: Matrix,
        noise_variance: f64,
        steps: Vec<UnrolledStep>,
        output: Layer,
    ) -> Result<Self, UnrolledError> {
        let n = prior.nrows();
        let range = |field, value, valid, range| {
            if valid {
                Ok(())
            } else {
                Err(UnrolledError::Range { field, value, range })
            }
        };
        range(
            "taxels",
            n as f64,
            (1..=MOST_TAXELS).contains(&n) && prior.ncols() == n,
            "[1, 4096]",
        )?;
        range("steps", steps.len() as f64, steps.len() <= 100, "[0, 100]")?;
        if !prior.view().values().iter().all(|v| v.is_finite()) {
            return Err(UnrolledError::NotFinite {
                what: "the prior".to_owned(),
            });
        }
        let trace: f64 = (0..n).map(|i| prior.row(i)[i]).sum();
        let [least, most] = MOMENTS;
        range(
            "trace of the prior",
            trace,
            (least..=most).contains(&trace),
            "[1e-3, 1e3]",
        )?;
        range(
            "noise_variance",
            noise_variance,
            (1e-5..=most).contains(&noise_variance),
            "[1e-5, 1e3]",
        )?;
        let memory = (output.weights.len() / n)
            .checked_sub(n)
            .ok_or_else(|| UnrolledError::Length {
                what: "weights of the output".to_owned(),
                len: output.weights.len(),
                expected: n * n,
            })?;
        for (t, step) in steps.iter().enumerate() {
            let hidden = step.hidden.bias.len();
            step.hidden
                .check(&format!("step {t}, hidden"), 4 * n + memory + 2, hidden)?;
            step.change.check(&format!("step {t}, change"), hidden, n + memory)?;
        }
        output.check("the output", memory + n, n)?;
        Ok(Self {
            prior,
            noise_variance,
            steps,
            output,
            memory,
        })
    }

    /// An untrained network for `taxels` that are independent and alike. Every step adds the linear estimate from the
    /// residual and sets negative values to zero; taxels above a quarter of the image's length count as touched.
    ///
    /// # Errors
    /// [`UnrolledError`] if the number of taxels or the noise is out of range.
    pub fn plain(taxels: usize, noise_variance: f64) -> Result<Self, UnrolledError> {
        let n = taxels;
        let mut prior = Matrix::zeros(n, n);
        let (mut weights, mut hidden, mut change) =
            (vec![0.0; n * n], vec![0.0; (4 * n + 2) * 2 * n], vec![0.0; 2 * n * n]);
        for i in 0..n {
            prior.row_mut(i)[i] = 1.0 / n as f64;
            weights[i * n + i] = STEEP;
            // what is added, above zero and below
            hidden[(n + i) * 2 * n + i] = 1.0;
            hidden[(n + i) * 2 * n + n + i] = -1.0;
            change[i * n + i] = 1.0;
            change[(n + i) * n + i] = -1.0;
        }
        let step = UnrolledStep {
            hidden: Layer::new(hidden, vec![0.0; 2 * n]),
            change: Layer::new(change, vec![0.0; n]),
        };
        let output = Layer::new(weights, vec![-STEEP / 4.0; n]);
        Self::new(prior, noise_variance, vec![step; PLAIN_STEPS], output)
    }

    /// N, taxels.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.prior.nrows()
    }
}
