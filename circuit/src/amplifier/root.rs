//! Zero of a monotone function.

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

    #[test]
    fn zeros_are_found_to_rounding() {
        assert_relative_eq!(
            crossing(&|t: f64| t.cos(), 0.0, 3.0),
            std::f64::consts::FRAC_PI_2,
            max_relative = 1e-15
        );
        assert_relative_eq!(crossing(&|t: f64| 1e-9 - t, 0.0, 3600.0), 1e-9, max_relative = 1e-15);
        assert_relative_eq!(
            crossing(&|t: f64| 1.0 - (1e3 * t).powi(2), 0.0, 100.0),
            1e-3,
            max_relative = 1e-15
        );
        assert_relative_eq!(
            crossing(&|t: f64| (-1e6 * t).exp() - 0.5, 0.0, 1.0),
            2_f64.ln() * 1e-6,
            max_relative = 1e-14
        );
    }

    #[test]
    fn ends_count() {
        assert_relative_eq!(crossing(&|t: f64| t, 0.0, 1.0), 0.0);
        assert_relative_eq!(crossing(&|t: f64| 1.0 - t, 0.0, 1.0), 1.0);
        assert_relative_eq!(crossing(&|t: f64| 1.0 + t, 0.0, 1.0), 0.0);
    }
}
