//! Several kinds of images at once: what a row is worth where the worst kind counts, and not the mean of all images.

/// p of [`worth`].
const SHARPNESS: i32 = 16;

/// Trace of the covariance of one Gaussian, in the square of the images' unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trace {
    /// tr C, before any measurement.
    before: f64,
    /// tr P, after those taken so far.
    left: f64,
}

impl Trace {
    /// Before any measurement, tr C = `before`.
    pub(super) fn new(before: f64) -> Self {
        Self { before, left: before }
    }

    /// After one more measurement, which leaves tr P = `left`.
    pub(super) fn lower(&mut self, left: f64) {
        self.left = left.max(0.0);
    }

    /// tr P.
    pub(super) fn left(self) -> f64 {
        self.left
    }

    /// How much a small fall of tr P adds to [`worth`], but for a factor that is the same for all kinds:
    /// ρᵖ⁻¹/tr C, with ρ relative to the `worst`, so that no power vanishes.
    pub(super) fn weight(self, worst: f64) -> f64 {
        (self.share(0.0) / worst.max(f64::MIN_POSITIVE)).powi(SHARPNESS - 1) / self.before
    }

    /// ρ: tr P / tr C once tr P has fallen by `fall`.
    pub(super) fn share(self, fall: f64) -> f64 {
        (self.left - fall).max(0.0) / self.before
    }
}

/// Worth of a row that lowers the traces of all kinds, each by its fall |Pₖ a|² / (aᵀPₖ a + σₖ²).
///
/// Of one kind it is the fall itself. Of K kinds it is −Σₖ ρₖᵖ, where ρₖ = tr Pₖ / tr Cₖ after the row and p = 16. As
/// maxₖ ρₖ ≤ (Σₖ ρₖᵖ)^(1/p) ≤ K^(1/p) maxₖ ρₖ, this is the largest share that is left, made smooth. A search for the
/// largest share itself stalls where two kinds tie: a row that helps one of them lowers nothing then (A. Krause et al.,
/// J. Mach. Learn. Res. 9 (2008) 2761, §3). The sum sees such a row, and among rows that help the worst kinds alike it
/// takes the one that helps the others.
pub(super) fn worth(mut kinds: impl ExactSizeIterator<Item = (Trace, f64)>) -> f64 {
    if kinds.len() == 1 {
        return kinds.next().map_or(0.0, |(_, fall)| fall);
    }
    -kinds.map(|(trace, fall)| trace.share(fall).powi(SHARPNESS)).sum::<f64>()
}
