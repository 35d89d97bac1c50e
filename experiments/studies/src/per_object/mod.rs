//! Compares twin and skin object by object: the twin's scores over many simulated skins form a band, with which the
//! real skin's score is compared.
//!
//! One simulated skin says little: its taxels, session and noise are a single draw, and in a mean over objects errors
//! cancel. Here the band of an object shows what a further skin of the twin would score, and the distance between twin
//! and skin is the mean over objects of |twin − real|.

mod band;
mod images;
mod skin;
mod study;
mod text;

pub use band::{ObjectBand, ObjectScore, SCORES, ScoreDistance, ScoreOf, bands, distances};
pub use images::ReadoutImages;
pub use study::{DECODERS, MEASUREMENTS, PerObjectError, PerObjectReport, PerObjectStudy};
