//! Reconstructs images of large skins with operators that are never stored.
//!
//! ```
//! use spts_recon::matrix_free::RegionPursuit;
//! use spts_recon::operator::{LinearOperator as _, SignGenerator, SignOperator};
//!
//! // 30 × 30 taxels, one of them pressed, 150 measurements with pseudorandom signs
//! let generator = SignGenerator::new(1_664_525, 1_013_904_223, 31)?;
//! let seeds = (0..900_u32).map(|k| k.wrapping_mul(0x85eb_ca6b)).collect();
//! let phi = SignOperator::new(generator, seeds, 0, 150);
//! let (mut image, mut y) = (vec![0.0; 900], vec![0.0; 150]);
//! image[12 * 30 + 17] = 1.0;
//! phi.apply(&image, &mut y);
//! let found = RegionPursuit::new(30, 30).recover(&phi, &y, None)?;
//! let strongest = (0..900).max_by(|&a, &b| found.image[a].total_cmp(&found.image[b]));
//! assert_eq!(strongest, Some(12 * 30 + 17));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod patches;
mod pursuit;
mod sheet;

pub use patches::{OnSheet, Patches, Rows};
pub use pursuit::{Descent, Found, RegionPursuit};
pub use sheet::{SheetDecoder, SheetNoise, SheetPrior};
