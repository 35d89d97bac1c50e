//! Power laws of cost against size.

use serde::Serialize;

/// y = prefactor · x^exponent, by least squares of the logarithms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    /// Exponent.
    pub exponent: f64,
    /// Standard error of the exponent, from the scatter about the line.
    pub exponent_se: f64,
    /// y at x = 1.
    pub prefactor: f64,
    /// Number of points.
    pub points: usize,
}

/// Power law through points above 0; `None` for fewer than 3 of them, or all at one x.
pub(super) fn power_law(points: &[(f64, f64)]) -> Option<PowerLaw> {
    let logs = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite());
    let logs: Vec<(f64, f64)> = logs.map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = logs
        .iter()
        .fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let sxx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    let sxy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    if logs.len() < 3 || sxx <= 0.0 {
        return None;
    }
    let exponent = sxy / sxx;
    let rest: f64 = logs.iter().map(|(x, y)| (y - my - exponent * (x - mx)).powi(2)).sum();
    Some(PowerLaw {
        exponent,
        exponent_se: (rest / (n - 2.0) / sxx).sqrt(),
        prefactor: (my - exponent * mx).exp(),
        points: logs.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_is_found_with_its_error() {
        let points: Vec<(f64, f64)> = [1.0, 10.0, 100.0, 1e3].map(|x: f64| (x, 3.0 * x.powf(1.5))).to_vec();
        let law = power_law(&points).unwrap();
        // logarithms of numbers up to 1e5, rounded
        assert!((law.exponent - 1.5).abs() < 1e-13 && (law.prefactor - 3.0).abs() < 1e-12 && law.exponent_se < 1e-13);
        // by hand: logs at 0, 1, 2 with values 0, 1, 1: slope ½, residuals −1/6, 1/3, −1/6, their squares sum to 1/6,
        // Sxx = 2
        let e = std::f64::consts::E;
        let law = power_law(&[(1.0, 1.0), (e, e), (e * e, e)]).unwrap();
        assert!((law.exponent - 0.5).abs() < 1e-14 && (law.exponent_se - (1.0_f64 / 12.0).sqrt()).abs() < 1e-14);
        assert_eq!(power_law(&points[..2]), None);
    }
}
