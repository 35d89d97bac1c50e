//! Assigns rows to training, validation and tests.

use crate::spec::{Spec, SplitBy};
use rand::RngExt as _;

/// The split of press number `press`, whose first shape has the number `shape`: `train`, `validation` or `test`.
pub(super) fn split(spec: &Spec, press: u64, shape: u64) -> &'static str {
    let number = match spec.split_by() {
        SplitBy::Press => press,
        // every number is another procedural shape; a mesh file or an object comes again
        SplitBy::Object if spec.choices().are_procedural() => shape,
        SplitBy::Object => shape % spec.choices().classes().len() as u64,
    };
    let shares = &spec.config().split;
    let at: f64 = spec.streams().rng("split", number).random();
    if at < shares.test {
        "test"
    } else if at < shares.test + shares.validation {
        "validation"
    } else {
        "train"
    }
}
