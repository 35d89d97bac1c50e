//! The crossings as a table.

use super::study::{Crossing, PhaseReport};

/// Undersamplings of the printed table.
const SHOWN: [f64; 2] = [0.25, 0.5];

impl PhaseReport {
    /// Crossings at δ = 0.25 and 0.5, one line for each method, with the theoretical values.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = format!(
            "Sparsity rho = S/M at which half of {} problems with N = {} are solved, beside the theory for N without bound\n\
             | {:<10} | {:^23} | {:^23} | {:<7} |\n| {:<10} | {:>14} | {:>6} | {:>14} | {:>6} | {:<7} |\n",
            self.trials,
            self.unknowns,
            "",
            "M/N = .25",
            "M/N = .5",
            "",
            "method",
            "found",
            "theory",
            "found",
            "theory",
            "curve",
        );
        for method in &self.methods {
            let cells: Vec<String> = SHOWN
                .iter()
                .map(|delta| cell(self.crossings.iter().filter(|c| c.method == method.name), *delta))
                .collect();
            let curve = match method.theory {
                super::Theory::Weak => "weak",
                super::Theory::Orthant => "orthant",
            };
            out.push_str(&format!(
                "| {:<10} | {} | {curve:<7} |\n",
                method.name,
                cells.join(" | ")
            ));
        }
        out
    }
}

/// Crossing and theory at the undersampling nearest to `delta`.
fn cell<'a>(crossings: impl Iterator<Item = &'a Crossing>, delta: f64) -> String {
    let away = |c: &Crossing| (c.delta - delta).abs();
    let Some(nearest) = crossings.min_by(|a, b| away(a).total_cmp(&away(b))) else {
        return format!("{:>14} | {:>6}", "", "");
    };
    let found = match (nearest.rho, nearest.standard_error) {
        (Some(rho), Some(error)) => format!("{rho:.3} ± {error:.3}"),
        _ => "above 1".to_owned(),
    };
    format!("{found:>14} | {:>6.3}", nearest.theory_rho)
}
