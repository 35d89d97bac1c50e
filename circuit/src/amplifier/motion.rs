//! Free motion of a second-order system, and zeros of monotone functions.

/// Modes of ẍ − 2σẋ + (σ² − δ)x = 0 with σ ≤ 0: λ = σ ± √δ.
#[derive(Debug, Clone, Copy)]
pub(super) struct Decay {
    sigma: f64,
    /// δ: the modes decay without oscillation for δ ≥ 0, and oscillate for δ < 0.
    delta: f64,
    /// √|δ|.
    root: f64,
    /// Slow real mode −(σ² − δ)/(|σ| + √δ), in a form that does not lose digits; σ if the modes oscillate.
    slow: f64,
}

impl Decay {
    /// Modes with the sum 2·`sigma` ≤ 0 and the product `product` > 0; `delta` is σ² − product.
    pub(super) fn new(sigma: f64, product: f64, delta: f64) -> Self {
        let root = delta.abs().sqrt();
        let slow = if delta >= 0.0 { product / (sigma - root) } else { sigma };
        Self { sigma, delta, root, slow }
    }

    /// σ, 1/s.
    pub(super) fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Angular frequency of the oscillation, rad/s, if there is one.
    pub(super) fn turning(&self) -> Option<f64> {
        (self.delta < 0.0).then_some(self.root)
    }

    /// Rate of the mode that lasts longest, 1/s.
    pub(super) fn slowest_per_s(&self) -> f64 {
        -self.slow
    }

    /// Rate at which the motion follows at most, 1/s: that of the fast mode or of the oscillation.
    pub(super) fn fastest_per_s(&self) -> f64 {
        self.root.max(-self.sigma)
    }

    /// Slow and fast mode, 1/s; both σ where they oscillate.
    fn modes(&self) -> (f64, f64) {
        if self.delta >= 0.0 { (self.slow, self.sigma - self.root) } else { (self.sigma, self.sigma) }
    }

    /// Time after which the faster of two real modes is below rounding; infinite where the modes oscillate.
    pub(super) fn fast_gone_s(&self) -> f64 {
        if self.delta >= 0.0 { 40.0 / -self.modes().1 } else { f64::INFINITY }
    }

    /// e^(σt)·cosh(√δ t) and e^(σt)·sinh(√δ t)/√δ, both entire functions of δ: they pass smoothly through the critical
    /// case, and they are bounded for every t ≥ 0.
    pub(super) fn at(&self, t: f64) -> (f64, f64) {
        if self.delta < 0.0 {
            let e = (self.sigma * t).exp();
            let (sin, cos) = (self.root * t).sin_cos();
            return (e * cos, e * sin / self.root);
        }
        let (e, x) = ((self.slow * t).exp(), 2.0 * self.root * t);
        // 1 − e^(−x), which is x for a small one
        let lost = -(-x).exp_m1();
        let s = if x > 0.0 { lost / (2.0 * self.root) } else { t };
        (e * (1.0 - 0.5 * lost), e * s)
    }

    /// Value at `t` of the motion that starts with the value `x` and the slope `slope`.
    pub(super) fn value(&self, x: f64, slope: f64, t: f64) -> f64 {
        let (c, s) = self.at(t);
        c * x + s * (slope - self.sigma * x)
    }

    /// First two times after 0 at which that motion is 0; infinite where there is none. The second follows half a turn
    /// later.
    pub(super) fn zeros(&self, x: f64, slope: f64) -> [f64; 2] {
        let none = f64::INFINITY;
        if self.delta < 0.0 {
            let half_turn = std::f64::consts::PI / self.root;
            let phase = (-x).atan2((slope - self.sigma * x) / self.root);
            let first = phase.rem_euclid(std::f64::consts::PI) / self.root;
            return if first > 0.0 { [first, first + half_turn] } else { [half_turn, 2.0 * half_turn] };
        }
        // x = P e^(slow t) + R e^(fast t) is 0 when e^((slow − fast) t) = −R/P = 1 + ratio
        let (_, fast) = self.modes();
        let ratio_per_root = -2.0 * x / (slope - fast * x);
        let ratio = ratio_per_root * self.root;
        let first = if ratio > 1e-300 {
            ratio.ln_1p() / (2.0 * self.root)
        } else {
            // equal modes
            0.5 * ratio_per_root
        };
        let found = first > 0.0 && first.is_finite();
        [if found { first } else { none }, none]
    }
}

/// Steps after which the bracket is taken as it is; about ten do.
const STEPS: u32 = 200;
/// Steps after which every second one is a bisection: a secant crawls along a parabola that is far wider than its zero.
const PATIENCE: u32 = 16;

/// Zero of `f` between `low` and `high`, where `f` has one sign at `low` and the other, or 0, at `high`. The end of the
/// bracket beyond the zero, seen from `low`; `low` itself where `f` has the sign of `high` there already.
///
/// The Illinois rule: M. Dowell and P. Jarratt, "A modified regula falsi method for computing the root of an equation",
/// BIT 11 (1971), with a bisection now and then.
pub(super) fn crossing(f: &impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (mut a, mut b) = (low, high);
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 || (fa > 0.0) == (fb > 0.0) {
        return low;
    }
    let positive = fa > 0.0;
    // side that moved last: the other end's value is halved when it stays for a second step
    let mut last = None;
    for step in 0..STEPS {
        if b - a <= 4.0 * f64::EPSILON * b.abs() || fb == 0.0 {
            break;
        }
        let secant = b - fb * (b - a) / (fb - fa);
        let bisects = step % 8 == 7 || (step >= PATIENCE && step % 2 == 1);
        let inside = secant > a && secant < b && !bisects;
        let t = if inside { secant } else { 0.5 * (a + b) };
        let ft = f(t);
        let moves_low = ft != 0.0 && (ft > 0.0) == positive;
        if moves_low {
            (a, fa) = (t, ft);
        } else {
            (b, fb) = (t, ft);
        }
        if last == Some(moves_low) && ft != 0.0 {
            if moves_low { fb *= 0.5 } else { fa *= 0.5 }
        }
        last = Some(moves_low);
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The motion solves its differential equation and starts where it was told to, on both sides of the critical case
    /// and in it. Central differences of step h have an error of h²/6 · |x‴| ≤ 1e-9 here, and rounding of 1e-16/h² in
    /// the second one.
    #[test]
    fn the_motion_solves_its_equation() {
        for product in [0.1, 0.999_999, 1.0, 1.000_001, 30.0] {
            let decay = Decay::new(-1.0, product, 1.0 - product);
            let x = |t| decay.value(0.7, -0.4, t);
            assert_relative_eq!(x(0.0), 0.7, epsilon = 1e-15);
            let h = 1e-4;
            for t in [0.5, 1.0, 2.0] {
                let first = (x(t + h) - x(t - h)) / (2.0 * h);
                let second = (x(t + h) - 2.0 * x(t) + x(t - h)) / (h * h);
                assert_relative_eq!(second + 2.0 * first + product * x(t), 0.0, epsilon = 1e-5);
            }
            assert_relative_eq!((x(h) - x(0.0)) / h, -0.4, epsilon = 1e-2);
        }
    }

    /// No jump at the critical case: one part in 1e12 of damping changes the motion by no more than that.
    #[test]
    fn the_critical_case_is_smooth() {
        let at = |delta: f64| Decay::new(-3.0, 9.0 - delta, delta).value(1.0, -5.0, 0.7);
        for delta in [1e-12, -1e-12, 1e-30, -1e-30] {
            assert_relative_eq!(at(delta), at(0.0), max_relative = 1e-12);
        }
    }

    #[test]
    fn zeros_are_zeros() {
        for (product, x, slope) in [(30.0, 1.0, 2.0), (30.0, 0.0, 1.0), (0.5, 1.0, -4.0), (1.0, 1.0, -4.0)] {
            let decay = Decay::new(-1.0, product, 1.0 - product);
            let zeros = decay.zeros(x, slope);
            assert!(zeros[0].is_finite());
            for t in zeros.into_iter().filter(|t| t.is_finite()) {
                assert!(t > 0.0);
                // slopes of order 5 times the rounding of t
                assert_relative_eq!(decay.value(x, slope, t), 0.0, epsilon = 1e-14);
            }
        }
        assert!(Decay::new(-1.0, 0.5, 0.5).zeros(1.0, -0.1)[0].is_infinite());
    }

    #[test]
    fn zeros_are_found_to_rounding() {
        assert_relative_eq!(crossing(&|t: f64| t.cos(), 0.0, 3.0), std::f64::consts::FRAC_PI_2, max_relative = 1e-15);
        assert_relative_eq!(crossing(&|t: f64| 1e-9 - t, 0.0, 3600.0), 1e-9, max_relative = 1e-15);
        assert_relative_eq!(crossing(&|t: f64| 1.0 - (1e3 * t).powi(2), 0.0, 100.0), 1e-3, max_relative = 1e-15);
        assert_relative_eq!(
            crossing(&|t: f64| (-1e6 * t).exp() - 0.5, 0.0, 1.0),
            2_f64.ln() * 1e-6,
            max_relative = 1e-14
        );
    }
}
