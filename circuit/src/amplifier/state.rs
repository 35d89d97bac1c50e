//! Load and state of the amplifier.

/// What the taxels feed into the bus while their drives are constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BusLoad {
    /// S = ΣGk, S. Range [0, 1e9].
    pub conductance_s: f64,
    /// I = ΣGk·Vk, A. The output settles near −Rf·I, which must lie within ± 1e9 V.
    pub current_a: f64,
}

impl BusLoad {
    /// Finite, and no negative conductance.
    pub(super) fn check(self) {
        let Self {
            conductance_s,
            current_a,
        } = self;
        debug_assert!(
            conductance_s.is_finite() && conductance_s >= 0.0 && current_a.is_finite(),
            "a load of {conductance_s} S and {current_a} A is not finite, or negative"
        );
    }
}

/// Bus and output at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct State {
    pub(super) sum_v: f64,
    pub(super) output_v: f64,
}
