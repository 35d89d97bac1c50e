//! Halving and doubling the resolution of a patch of cells.

/// Rows and columns of the next coarser patch.
pub(crate) fn coarser([rows, cols]: [usize; 2]) -> [usize; 2] {
    [rows.div_ceil(2), cols.div_ceil(2)]
}

/// Mean of the finite values of each 2 × 2 block; negative infinity where there are none.
pub(crate) fn restrict(fine: &[f64], [rows, cols]: [usize; 2], coarse: &mut Vec<f64>) {
    let [coarse_rows, coarse_cols] = coarser([rows, cols]);
    coarse.clear();
    for i in 0..coarse_rows {
        for j in 0..coarse_cols {
            let (mut sum, mut count) = (0.0, 0.0);
            for r in 2 * i..(2 * i + 2).min(rows) {
                for value in &fine[r * cols + 2 * j..r * cols + (2 * j + 2).min(cols)] {
                    if value.is_finite() {
                        sum += value;
                        count += 1.0;
                    }
                }
            }
            coarse.push(if count > 0.0 { sum / count } else { f64::NEG_INFINITY });
        }
    }
}

/// Bilinear interpolation of `coarse` at the fine cells' centres; coarse cells without a `target` (no body there) are
/// left out and the others weigh more. Cells of a coarse one without pressure have none.
pub(crate) fn prolong(coarse: &[f64], target: &[f64], [rows, cols]: [usize; 2], fine: &mut Vec<f64>) {
    let [coarse_rows, coarse_cols] = coarser([rows, cols]);
    let near = |i: usize, n: usize| {
        let own = i / 2;
        let other = if i % 2 == 1 {
            (own + 1).min(n - 1)
        } else {
            own.saturating_sub(1)
        };
        [(own, 0.75), (other, 0.25)]
    };
    fine.clear();
    for r in 0..rows {
        let across = near(r, coarse_rows);
        for c in 0..cols {
            // the coarse contact set is right on average, and a cell too few costs less than one too many
            if coarse[r / 2 * coarse_cols + c / 2] <= 0.0 {
                fine.push(0.0);
                continue;
            }
            let along = near(c, coarse_cols);
            let (mut sum, mut weight) = (0.0, 0.0);
            for (i, wi) in across {
                for (j, wj) in along {
                    let cell = i * coarse_cols + j;
                    if target[cell].is_finite() {
                        sum += wi * wj * coarse[cell];
                        weight += wi * wj;
                    }
                }
            }
            fine.push(if weight > 0.0 { sum / weight } else { 0.0 });
        }
    }
}
