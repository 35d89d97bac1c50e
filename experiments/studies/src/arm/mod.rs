//! A skin wrapped round a robot's arm and touched by a finger: compares the published recording with the twin's bent
//! skin (`spts simulate arm`), statistic by statistic.
//!
//! A bent skin is under a preload, so that some taxels have an output without a touch. The size of that output and the
//! number of such taxels show whether the twin's preload is like the real one. The size of a touch, and how accurately
//! it is located, show whether the rest is.

mod statistics;
mod study;
mod text;

pub use statistics::{LOADED_V, MEASUREMENTS, STATISTICS, StatisticOf, TouchStatistics};
pub use study::{ArmBand, ArmReport, ArmStudy};
