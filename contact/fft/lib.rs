//! Plans of fast Fourier transforms. Whatever crate asks `rustfft` for a plan compiles all of its kernels; this one
//! does, and the others ask it.

pub use realfft::num_complex::Complex;
pub use realfft::num_traits;
pub use realfft::{ComplexToReal, FftNum, RealToComplex};
pub use rustfft::Fft;
use std::sync::Arc;

/// Plans of one precision, which are kept for the next who ask for the same length.
///
/// ```
/// use spts_fft::Planner;
///
/// let (forward, inverse) = Planner::<f64>::new().real(4);
/// let (mut values, mut spectrum) = (vec![1.0, 2.0, 3.0, 4.0], forward.make_output_vec());
/// forward.process(&mut values, &mut spectrum)?;
/// assert_eq!((spectrum[0].re, spectrum[2].re), (10.0, -2.0));
/// inverse.process(&mut spectrum, &mut values)?;
/// assert_eq!(values[3], 4.0 * 4.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Planner<T: FftNum> {
    real: realfft::RealFftPlanner<T>,
    complex: rustfft::FftPlanner<T>,
}

/// Forward and inverse transform of real values; neither is normalised.
pub type RealPlans<T> = (Arc<dyn RealToComplex<T>>, Arc<dyn ComplexToReal<T>>);
/// Forward and inverse transform of complex values; neither is normalised.
pub type ComplexPlans<T> = (Arc<dyn Fft<T>>, Arc<dyn Fft<T>>);

macro_rules! planner {
    ($precision:ty) => {
        impl Planner<$precision> {
            /// A planner that has planned nothing yet.
            #[expect(clippy::new_without_default, reason = "one way is enough")]
            pub fn new() -> Self {
                Self { real: realfft::RealFftPlanner::new(), complex: rustfft::FftPlanner::new() }
            }

            /// Transforms of `len` real values.
            pub fn real(&mut self, len: usize) -> RealPlans<$precision> {
                (self.real.plan_fft_forward(len), self.real.plan_fft_inverse(len))
            }

            /// Transforms of `len` complex values.
            pub fn complex(&mut self, len: usize) -> ComplexPlans<$precision> {
                (self.complex.plan_fft_forward(len), self.complex.plan_fft_inverse(len))
            }
        }
    };
}

planner!(f32);
planner!(f64);
