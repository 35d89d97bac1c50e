//! Localisation of contacts.
//!
//! ```
//! use spts_recon::localise::{BlobConfig, Localiser, centre_of_mass};
//!
//! // of an image: 2 × 3 taxels, threshold 0.23 of the largest
//! assert_eq!(centre_of_mass(&[0.0, 1.0, 1.0, 0.0, 1.0, 1.0], 3, 0.23), Some([0.5, 1.5]));
//!
//! // of the measurements themselves: one taxel of 4 × 4 is pressed, and every row of weights marks one taxel
//! let localiser = Localiser::new(&BlobConfig::new(4, 4))?;
//! let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
//! for taxel in 0..16 {
//!     let mut weights = [0.0; 16];
//!     weights[taxel] = 1.0;
//!     localiser.project(&weights, &mut projected)?;
//!     evidence.observe(&projected, if taxel == 6 { 2.0 } else { 0.0 })?;
//! }
//! let [row, col] = localiser.estimate(&mut evidence).position_px;
//! assert!((row - 1.0).abs() < 0.5 && (col - 2.0).abs() < 0.5);
//! # Ok::<(), spts_recon::RangeError>(())
//! ```

mod blob;
mod centre;

pub use blob::{BlobConfig, BlobEvidence, Estimate, Localiser};
pub use centre::{centre_of_mass, distance};
