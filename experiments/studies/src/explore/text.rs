//! The exploration as a text table.

use super::report::ExploreReport;
use crate::electronics::ElectronicsStudy;
use spts_circuit::amplifier::Limit;

impl ExploreReport {
    /// The results as a text table.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::from(
            "| taxels | readout               | wires | fails by          | M, IoU .8 | M/N %  | M, 1 px | best IoU | period µs | acquire ms | raster ms | decode ms | MB    |\n\
             |-------:|-----------------------|------:|-------------------|----------:|-------:|--------:|---------:|----------:|-----------:|----------:|----------:|------:|\n",
        );
        let or = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
        for r in &self.rows {
            let trial = r.deciding();
            out.push_str(&format!(
                "| {:>6} | {:<21} | {:>5} | {:<17} | {:>9} | {:>6} | {:>7} | {:>8.3} | {:>9.1} | {:>10} | {:>9.1} | {:>9} | {:>5} |\n",
                r.taxels,
                r.way.name(),
                r.wires,
                r.limit.map_or("–", Limit::name),
                or(r.m_iou.map(|m| m.to_string())),
                or(r.m_iou.map(|m| format!("{:.2}", 100.0 * m as f64 / r.taxels as f64))),
                or(r.m_located.map(|m| m.to_string())),
                r.best_iou(),
                r.period_s * 1e6,
                or(r.acquire_s.map(|s| format!("{:.2}", s * 1e3))),
                r.raster_s * 1e3,
                or(trial.map(|t| format!("{:.1}", t.decode_s * 1e3))),
                or(trial.map(|t| format!("{:.1}", t.bytes as f64 / 1e6))),
            ));
        }
        if let Ok(designed) = ElectronicsStudy::as_designed() {
            let one_wire = designed.one_wire_text(self.one_wire_taxels);
            out.push_str(&format!("\nas designed, {one_wire}\n"));
        }
        if !self.fits.is_empty() {
            out.push_str("\ncost ∝ taxels^p, p ± one standard error:\n");
        }
        for f in &self.fits {
            out.push_str(&format!(
                "{}, {}: {:.2} ± {:.2} ({} sizes)\n",
                f.way.name(),
                f.cost,
                f.law.exponent,
                f.law.exponent_se,
                f.law.points
            ));
        }
        out
    }
}
