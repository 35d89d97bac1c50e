//! Several kinds of images at once: what a row is worth where the worst kind counts, and not the mean of all images.

/// p of [`worth`].
const SHARPNESS: i32 = 4;

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
/// Of one kind it is the fall itself. Of K kinds it is −Σₖ ρₖᵖ, where ρₖ = tr Pₖ / tr Cₖ after the row and p = 4. As
/// maxₖ ρₖ ≤ (Σₖ ρₖᵖ)^(1/p) ≤ K^(1/p) maxₖ ρₖ, this is the largest share that is left, made smooth. A search for the
/// largest share itself stalls where two kinds tie: a row that helps one of them lowers nothing then (A. Krause et al.,
/// J. Mach. Learn. Res. 9 (2008) 2761, §3). The sum sees such a row, and among rows that help the worst kinds alike it
/// takes the one that helps the others. A larger p costs the other kinds more than the worst one gains: of bars one
/// taxel wide among broad plates, p = 4 has most of the gain of p = 16, and less than half of its losses.
pub(super) fn worth(mut kinds: impl ExactSizeIterator<Item = (Trace, f64)>) -> f64 {
    if kinds.len() == 1 {
        return kinds.next().map_or(0.0, |(_, fall)| fall);
    }
    -kinds.map(|(trace, fall)| trace.share(fall).powi(SHARPNESS)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use crate::recover::ImagePrior;
    use crate::rows::greedy::Greedy;
    use crate::rows::simple::{CosineSigns, Random, Separable};
    use crate::rows::{Classes, DesignRows as _, Expected, RowTask, choose_for_images, posterior_trace};

    const SHAPE: [usize; 2] = [8, 8];

    /// Images of bars of this width along both axes at all places, or of squares of that side.
    fn images(side: usize, bars: bool) -> Matrix {
        let [rows, cols] = SHAPE;
        let within = |at: usize, from: usize, length: usize| (from..from + length).contains(&at);
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for (r, c) in (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c))) {
            for [down, across] in if bars { [[side, 5], [5, side]] } else { [[side, side]; 2] } {
                let inside = |k: usize| within(k / cols, r, down) && within(k % cols, c, across);
                columns.push((0..rows * cols).map(|k| f64::from(u8::from(inside(k)))).collect());
            }
        }
        Matrix::from_column_slices(rows * cols, &columns)
    }

    fn like(images: &[&Matrix]) -> Expected {
        let how = ImagePrior { reach: 0, stay: 1.0, threshold: 0.0, ..ImagePrior::UNSEEN };
        let columns = images.iter().flat_map(|of| (0..of.ncols()).map(|k| of.column(k)));
        let all = Matrix::from_column_slices(SHAPE[0] * SHAPE[1], &columns.collect::<Vec<_>>());
        Expected::like(&how.learn(&all, SHAPE[1]).unwrap(), SHAPE, Default::default()).unwrap()
    }

    /// Thin bars, and many more broad squares: rows for the mean see the squares.
    fn bars_among_squares() -> (Expected, Vec<Expected>) {
        let (bars, squares, plates) = (images(1, true), images(3, false), images(5, false));
        let all = like(&[&bars, &squares, &plates, &squares, &plates]);
        (all, [&bars, &squares, &plates].iter().map(|kind| like(&[kind])).collect())
    }

    /// Shares that are left of each kind after `rows`.
    fn left(task: &RowTask<'_>, kinds: &[Expected], rows: &Matrix) -> Vec<f64> {
        let of = |expected| posterior_trace(&RowTask { expected, kinds: &[], ..*task }, rows).unwrap();
        kinds.iter().map(of).collect()
    }

    /// By so much, at most, a kind ends worse than with rows for the mean.
    const LOST: f64 = 0.06;

    fn better_at_worst(own: &[f64], for_mean: &[f64]) {
        let worst = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
        assert!(worst(own) < worst(for_mean), "{own:?} {for_mean:?}");
        assert!(own.iter().zip(for_mean).all(|(own, mean)| own - mean < LOST), "{own:?} {for_mean:?}");
    }

    #[test]
    fn the_worst_kind_is_seen_better_and_no_other_is_lost() {
        let (all, kinds) = bars_among_squares();
        let candidates = Random.design(&RowTask::new(150, &all)).unwrap();
        for m in [4, 8, 16, 24] {
            let for_mean = RowTask::new(m, &all);
            let worst = RowTask { kinds: &kinds, ..for_mean };
            let designed = |task: &RowTask<'_>| left(task, &kinds, &Greedy.design(task).unwrap());
            better_at_worst(&designed(&worst), &designed(&for_mean));
            let chosen = |task: &RowTask<'_>| {
                let chosen = choose_for_images(task, candidates.view()).unwrap();
                let rows: Vec<f64> = chosen.iter().flat_map(|&k| candidates.row(k)).copied().collect();
                left(task, &kinds, &Matrix::from_rows(m, 64, rows).unwrap())
            };
            better_at_worst(&chosen(&worst), &chosen(&for_mean));
        }
    }

    /// One kind that is all images is the mean of all images, bit for bit.
    #[test]
    fn a_single_kind_is_no_other_task() {
        let (all, _) = bars_among_squares();
        let plain = RowTask::new(6, &all);
        let one = RowTask { kinds: std::slice::from_ref(&all), ..plain };
        assert_eq!(Greedy.design(&plain), Greedy.design(&one));
        let candidates = Random.design(&RowTask::new(40, &all)).unwrap();
        assert_eq!(choose_for_images(&plain, candidates.view()), choose_for_images(&one, candidates.view()));
    }

    /// Two kinds that tie, each on a taxel of its own: the largest share falls by no row alone.
    #[test]
    fn a_tie_stalls_nothing() {
        let traces = [Trace::new(1.0), Trace::new(1.0)];
        let of = |falls: [f64; 2]| worth(traces.into_iter().zip(falls));
        assert!(of([0.5, 0.0]) > of([0.0, 0.0]) && of([0.5, 0.5]) > of([0.5, 0.4]));
        // rows that raise the second kind cannot make up for the first
        let mut uneven = traces;
        uneven[1].lower(0.5);
        let of = |falls: [f64; 2]| worth(uneven.into_iter().zip(falls));
        assert!(of([0.1, 0.0]) > of([0.0, 0.5]));
    }

    #[test]
    fn kinds_are_refused_where_they_do_not_count() {
        let (all, kinds) = bars_among_squares();
        let task = RowTask { kinds: &kinds, ..RowTask::new(4, &all) };
        for refused in [Random.design(&task), CosineSigns.design(&task), Separable.design(&task), Classes.design(&task)]
        {
            assert!(refused.unwrap_err().to_string().starts_with("`kinds` has 3; valid for "));
        }
        let other = [Expected::smooth([4, 4], 1.0).unwrap()];
        let refused = Greedy.design(&RowTask { kinds: &other, ..task }).unwrap_err().to_string();
        assert!(refused.contains("images of 16 taxels on a grid of 8 × 8"), "{refused}");
    }
}
