//! Recent solutions, used to start the next one.

use super::pcg::dot;
use crate::patch::Patch;

/// Answers kept: a flat shape that sinks and tilts about two axes has three degrees of freedom; one more for friction's
/// sake of round-off.
const KEPT: usize = 4;

/// A direction that adds less than this share of its own energy to the ones before is left out.
const INDEPENDENT: f64 = 1e-12;

/// Pressure and displacement of earlier answers, all on the same patch.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    patch: Patch,
    /// Newest first.
    answers: Vec<Answer>,
    spare: Vec<f64>,
}

#[derive(Debug, Clone, Default)]
struct Answer {
    pressure: Vec<f64>,
    displacement: Vec<f64>,
}

impl Memory {
    pub(crate) fn clear(&mut self) {
        self.answers.clear();
    }

    /// Moves to `patch` and puts the combination Σ cᵢ pᵢ of least energy ½ p·Cp − p·target into `start`; false when
    /// nothing is known.
    pub(crate) fn start(&mut self, patch: Patch, target: &[f64], start: &mut Vec<f64>) -> bool {
        self.shift(patch);
        start.clear();
        start.resize(target.len(), 0.0);
        let (mut factor, mut scaled) = ([[0.0; KEPT]; KEPT], [0.0; KEPT]);
        let mut used = [false; KEPT];
        // Cholesky of A_ij = p_i·u_j, skipping what depends on the newer ones
        for i in 0..self.answers.len() {
            let mut row = [0.0; KEPT];
            for j in 0..i {
                if used[j] {
                    let before: f64 = (0..j).map(|k| row[k] * factor[j][k]).sum();
                    row[j] = (dot(&self.answers[i].pressure, &self.answers[j].displacement) - before) / factor[j][j];
                }
            }
            let own = dot(&self.answers[i].pressure, &self.answers[i].displacement);
            let left = own - row.iter().map(|v| v * v).sum::<f64>();
            used[i] = left > INDEPENDENT * own;
            if used[i] {
                row[i] = left.sqrt();
                let load = finite_dot(&self.answers[i].pressure, target);
                let before: f64 = (0..i).map(|k| row[k] * scaled[k]).sum();
                scaled[i] = (load - before) / row[i];
                factor[i] = row;
            }
        }
        let mut share = [0.0; KEPT];
        for i in (0..self.answers.len()).rev().filter(|i| used[*i]) {
            let after: f64 = (i + 1..KEPT).map(|k| factor[k][i] * share[k]).sum();
            share[i] = (scaled[i] - after) / factor[i][i];
        }
        for (answer, share) in self.answers.iter().zip(share) {
            for (to, from) in start.iter_mut().zip(&answer.pressure) {
                *to += share * from;
            }
        }
        start.iter().any(|p| *p > 0.0)
    }

    /// Keeps the answer on the patch of the last [`Memory::start`] and lets the oldest go.
    pub(crate) fn keep(&mut self, pressure: &[f64], displacement: &[f64]) {
        let mut answer = if self.answers.len() < KEPT {
            Answer::default()
        } else {
            self.answers.pop().unwrap_or_default()
        };
        answer.pressure.clear();
        answer.pressure.extend_from_slice(pressure);
        answer.displacement.clear();
        answer.displacement.extend_from_slice(displacement);
        self.answers.insert(0, answer);
    }

    /// Moves the answers onto another patch; what lies beside it is lost, what is new is zero.
    fn shift(&mut self, patch: Patch) {
        if self.patch == patch {
            return;
        }
        let old = self.patch;
        for answer in &mut self.answers {
            for field in [&mut answer.pressure, &mut answer.displacement] {
                shifted(field, old, patch, &mut self.spare);
                std::mem::swap(field, &mut self.spare);
            }
        }
        self.patch = patch;
    }
}

fn shifted(field: &[f64], old: Patch, new: Patch, out: &mut Vec<f64>) {
    let (old_width, width) = (old.cols[1] - old.cols[0], new.cols[1] - new.cols[0]);
    out.clear();
    out.resize((new.rows[1] - new.rows[0]) * width, 0.0);
    let [first, end] = [old.cols[0].max(new.cols[0]), old.cols[1].min(new.cols[1])];
    if first >= end {
        return;
    }
    for row in old.rows[0].max(new.rows[0])..old.rows[1].min(new.rows[1]) {
        let from = (row - old.rows[0]) * old_width;
        let to = (row - new.rows[0]) * width;
        out[to + first - new.cols[0]..to + end - new.cols[0]]
            .copy_from_slice(&field[from + first - old.cols[0]..from + end - old.cols[0]]);
    }
}

/// Σ p d over the cells in contact; the others may have an infinite target.
fn finite_dot(pressure: &[f64], target: &[f64]) -> f64 {
    let cells = pressure.iter().zip(target);
    cells
        .map(|(p, d)| if *p > 0.0 && d.is_finite() { p * d } else { 0.0 })
        .sum()
}
