//! Preconditioned conjugate gradients for contact: no negative pressure and no penetration.

use super::convolution::System;

/// What is prescribed besides the shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Goal {
    /// The displacement itself is prescribed.
    Displacement,
    /// The sum of the pressure over all cells, Pa, is prescribed; the displacement is known up to a constant.
    PressureSum(f64),
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stop {
    /// Largest estimated error of a pressure, relative to the largest pressure.
    pub(crate) tolerance: f64,
    /// The same for the start. If the start fulfils it, it is returned unchanged.
    pub(crate) start_tolerance: f64,
    /// Largest number of iterations.
    pub(crate) iterations: usize,
}

/// How the elastic solver ended: the rigid approach, the iterations, and whether it converged.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Outcome {
    /// Rigid approach added to the given displacement, m; 0 when the displacement itself is prescribed.
    pub approach_m: f64,
    /// Number of iterations.
    pub iterations: usize,
    /// Whether the tolerance was reached. If not, the best pressure is kept.
    pub converged: bool,
}

/// Fields of one contact problem on a rectangle of cells, row-major.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fields {
    /// Prescribed displacement, m; negative infinity where contact is impossible.
    pub(crate) target: Vec<f64>,
    /// Pressure, Pa: the start on entry, the answer on return.
    pub(crate) pressure: Vec<f64>,
    /// C · pressure, m.
    pub(crate) displacement: Vec<f64>,
    /// 1 in contact, 0 elsewhere: the start on entry, the answer on return.
    pub(crate) contact: Vec<f64>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    image: Vec<f64>,
    step: Vec<f64>,
    unit: Vec<f64>,
}

impl Fields {
    /// Sets the number of cells; what was in the fields is lost.
    pub(crate) fn resize(&mut self, cells: usize) {
        for field in [
            &mut self.target,
            &mut self.pressure,
            &mut self.displacement,
            &mut self.contact,
            &mut self.residual,
            &mut self.direction,
            &mut self.image,
            &mut self.step,
            &mut self.unit,
        ] {
            field.clear();
            field.resize(cells, 0.0);
        }
    }
}

/// The contact set is revised when its violation exceeds this share of the error left on it.
const REVISE: f64 = 1.0;

/// From this iteration on the share grows, by [`PATIENCE_GROWTH`] an iteration: a set that flickers is then only
/// revised when the pressure on it is known well.
const PATIENCE: usize = 50;
const PATIENCE_GROWTH: f64 = 1.1;

/// Solves the contact problem in `fields`: p ≥ 0, C p ≥ target + approach, p (C p − target − approach) = 0.
///
/// Conjugate gradients on a fixed contact set, left as soon as the set's own error (negative pressures inside,
/// penetration outside) outweighs the residual on it: I. A. Polonsky and L. M. Keer, Wear 231 (1999) 206, with the
/// set revised as in the primal–dual active-set method (M. Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002)
/// 865). With the sum of pressure given, directions are kept at sum 0 and the approach is the multiplier of that.
pub(crate) fn solve(system: &mut System, f: &mut Fields, goal: Goal, stop: Stop) -> Outcome {
    let mut done = Outcome::default();
    f.start(system, goal);
    let (mut fresh, mut last_power, mut revise) = (true, 0.0, REVISE);
    while done.iterations < stop.iterations {
        done.iterations += 1;
        f.residual(done.approach_m);
        system.precondition(&f.residual, &f.contact, &mut f.image);
        if goal != Goal::Displacement {
            if fresh {
                system.precondition(&f.contact, &f.contact, &mut f.unit);
            }
            done.approach_m += f.balance();
        }
        let state = f.measure(done.approach_m, system.stiffness_pa_per_m);
        let tolerance = if done.iterations == 1 { stop.start_tolerance } else { stop.tolerance };
        if state.worst <= tolerance * state.highest {
            done.converged = true;
            break;
        }
        if done.iterations > PATIENCE {
            revise *= PATIENCE_GROWTH;
        }
        if state.violation > revise * revise * state.error {
            if f.revise(done.approach_m, goal) {
                system.displace(&f.pressure, &mut f.displacement);
            }
            fresh = true;
            continue;
        }
        let turn = if fresh { 0.0 } else { (state.change / last_power).max(0.0) };
        (fresh, last_power) = (false, state.power);
        for (t, z) in f.direction.iter_mut().zip(&f.image) {
            *t = z + turn * *t;
        }
        system.displace(&f.direction, &mut f.step);
        if !f.advance() {
            break;
        }
    }
    f.pressure.iter_mut().for_each(|p| *p = p.max(0.0));
    done
}

/// Sums over the cells that steer the iteration; squares of pressures where not said otherwise.
struct State {
    /// Preconditioned residual on the contact set: the estimated error there.
    error: f64,
    /// The larger of negative pressure inside the contact set and penetration outside it.
    violation: f64,
    /// Residual · preconditioned residual, and the same with the residual's change.
    power: f64,
    change: f64,
    /// Largest pressure, and largest error of any kind, Pa.
    highest: f64,
    worst: f64,
}

impl Fields {
    /// Displacement of the first pressure, which is brought to the sum that is asked for.
    fn start(&mut self, system: &mut System, goal: Goal) {
        self.residual.fill(0.0);
        if self.pressure.iter().all(|p| p.abs() <= 0.0) {
            self.displacement.fill(0.0);
            if let Goal::PressureSum(sum) = goal {
                let share = sum / self.contact.iter().sum::<f64>();
                for (p, inside) in self.pressure.iter_mut().zip(&self.contact) {
                    *p = share * inside;
                }
            } else {
                return;
            }
        }
        self.rescale(goal);
        system.displace(&self.pressure, &mut self.displacement);
    }

    fn rescale(&mut self, goal: Goal) {
        if let Goal::PressureSum(sum) = goal {
            let scale = sum / self.pressure.iter().sum::<f64>();
            self.pressure.iter_mut().for_each(|p| *p *= scale);
        }
    }

    /// Residual on the contact set, m, and in `step` its change.
    fn residual(&mut self, approach_m: f64) {
        let cells = self.target.iter().zip(&self.displacement).zip(&self.contact);
        let old = self.residual.iter_mut().zip(&mut self.step);
        for (((target, displacement), inside), (residual, step)) in cells.zip(old) {
            let r = if *inside > 0.0 { target + approach_m - displacement } else { 0.0 };
            *step = r - *residual;
            *residual = r;
        }
    }

    /// Corrects the approach so that the direction's sum vanishes, and returns the correction, m.
    fn balance(&mut self) -> f64 {
        let sum: f64 = self.image.iter().sum();
        let weight: f64 = self.unit.iter().sum();
        let correction_m = -sum / weight;
        for (z, q) in self.image.iter_mut().zip(&self.unit) {
            *z += correction_m * q;
        }
        correction_m
    }

    fn measure(&self, approach_m: f64, stiffness_pa_per_m: f64) -> State {
        let (mut negative, mut outside, mut highest, mut worst) = (0.0, 0.0, 0.0_f64, 0.0_f64);
        let surface = self.target.iter().zip(&self.displacement).zip(&self.contact);
        for ((p, z), ((target, displacement), inside)) in self.pressure.iter().zip(&self.image).zip(surface) {
            highest = if *p > highest { *p } else { highest };
            let depth_m = target + approach_m - displacement;
            let below = if *p < 0.0 { -p } else { 0.0 };
            let above = if depth_m > 0.0 { depth_m * stiffness_pa_per_m } else { 0.0 };
            let within = *inside > 0.0;
            let (below, above) = (if within { below } else { 0.0 }, if within { 0.0 } else { above });
            negative += below * below;
            outside += above * above;
            // the preconditioned residual is 0 outside
            for off in [z.abs(), below, above] {
                worst = if off > worst { off } else { worst };
            }
        }
        State {
            error: dot(&self.image, &self.image),
            violation: if negative > outside { negative } else { outside },
            power: dot(&self.image, &self.residual),
            change: dot(&self.image, &self.step),
            highest,
            worst,
        }
    }

    /// Drops cells in tension and adds cells that penetrate; true when the pressure has changed.
    fn revise(&mut self, approach_m: f64, goal: Goal) -> bool {
        let mut dropped = false;
        for i in 0..self.pressure.len() {
            if self.contact[i] > 0.0 {
                if self.pressure[i] < 0.0 {
                    self.pressure[i] = 0.0;
                    self.contact[i] = 0.0;
                    dropped = true;
                }
            } else if self.target[i] + approach_m > self.displacement[i] {
                self.contact[i] = 1.0;
            }
        }
        if dropped {
            self.rescale(goal);
        }
        dropped
    }

    /// Steps along the direction to the least energy; false when there is no way to go.
    fn advance(&mut self) -> bool {
        let length = dot(&self.direction, &self.residual) / dot(&self.direction, &self.step);
        if !length.is_finite() {
            return false;
        }
        for (p, t) in self.pressure.iter_mut().zip(&self.direction) {
            *p += length * t;
        }
        for (u, w) in self.displacement.iter_mut().zip(&self.step) {
            *u += length * w;
        }
        true
    }
}

/// Σ a b in eight partial sums, which the processor adds at the same time.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (a, b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}
