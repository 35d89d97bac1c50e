//! A skin wrapped round a robot's arm and touched by a finger: the published recording, and the twin's bent skin
//! (`spts simulate arm`) beside it, statistic by statistic.
//!
//! A bent skin carries a preload, so that some taxels have an output without a touch. How much and on how many says
//! whether the twin's preload is like the real one; how large a touch on top of it is, and how well it is located, says
//! whether the rest is.

mod statistics;
mod study;
mod text;

pub use statistics::{LOADED_V, MEASUREMENTS, STATISTICS, StatisticOf, TouchStatistics};
pub use study::{ArmBand, ArmError, ArmReport, ArmStudy};
