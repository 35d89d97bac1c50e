//! Twin and skin object by object: the twin's scores over many simulated skins as a band, and the real skin's score
//! beside it.
//!
//! One simulated skin says little: its taxels, its session and its noise are one draw, and errors of several objects
//! cancel in a mean over objects. Here the band of an object is what one more skin of the twin would score, and the
//! distance of twin and skin is the mean over objects of |twin − real|.

mod band;
mod images;
mod skin;
mod study;
mod text;

pub use band::{ObjectBand, ObjectScore, SCORES, ScoreDistance, ScoreOf, bands, distances};
pub use images::Images;
pub use study::{DECODERS, MEASUREMENTS, PerObjectError, PerObjectReport, PerObjectStudy};
