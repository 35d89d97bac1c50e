//! The study as text tables.

use super::study::SeedReport;
use std::fmt::Write as _;

impl SeedReport {
    /// All tables.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        self.facts_text(&mut out);
        self.windows_text(&mut out);
        self.search_text(&mut out);
        self.worth_text(&mut out);
        out
    }

    fn facts_text(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "| {:<16} | {:>6} | {:>10} | {:>20} | {:>15} | constant rows of the first 1000",
            "seeds", "taxels", "first rank", "least phase, rows", "nearly constant"
        );
        for facts in &self.facts {
            let rows: Vec<String> = facts.constant_rows.iter().map(usize::to_string).collect();
            let rows = if rows.is_empty() {
                "none".to_owned()
            } else {
                rows.join(" ")
            };
            let _ = writeln!(
                out,
                "| {:<16} | {:>6} | {:>10} | {:>20} | {:>13.2} % | {rows}",
                facts.seeds,
                facts.taxels,
                facts.first_rank,
                facts.least_phase_rows,
                100.0 * facts.nearly_constant_share
            );
        }
    }

    fn windows_text(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "\nWindows of M rows: coherence of columns and rows, largest and root mean square; bound of the isometry constant\n\
             | {:<16} | {:>4} | {:>7} | {:>5} | {:>9} | {:>7} | {:>7} | {:>7} | {:>7} | {:>7} | {:>7} | {:>7} | {:>9}",
            "seeds",
            "M",
            "rank",
            "least",
            "condition",
            "columns",
            "Welch",
            "rms",
            "rows",
            "worst",
            "rms",
            "full, %",
            "isometry"
        );
        for w in &self.windows {
            let _ = writeln!(
                out,
                "| {:<16} | {:>4} | {:>7.2} | {:>5} | {:>9.2} | {:>7.3} | {:>7.3} | {:>7.3} | {:>7.3} | {:>7.3} | {:>7.4} | {:>7.1} | δ{} ≥ {:.2}",
                w.seeds,
                w.m,
                w.rank_mean,
                w.rank_least,
                w.condition_median,
                w.column_coherence,
                w.welch_bound,
                w.column_rms,
                w.row_coherence,
                w.row_coherence_worst,
                w.row_rms,
                100.0 * w.full_rank_share,
                w.isometry_s,
                w.isometry_delta
            );
        }
    }

    fn search_text(&self, out: &mut String) {
        let s = &self.search;
        let _ = writeln!(
            out,
            "\nSearch: {} sets, mean square coherence of two of {} rows {:.5} → {:.5} on the windows it saw, {:.5} → {:.5} on others (the difference ± {:.5}). Proposed: {}",
            s.tried,
            s.m,
            s.mixed_cost,
            s.found_cost,
            s.mixed_cost_unseen,
            s.found_cost_unseen,
            s.unseen_se,
            self.proposed
        );
    }

    fn worth_text(&self, out: &mut String) {
        let _ = write!(
            out,
            "\nIoU, and how much more than with {}, image by image\n| {:<9} | {:>5} | {:<8} | {:>4} |",
            self.given, "images", "noise", "decoder", "M"
        );
        for set in &self.sets {
            let _ = write!(out, " {:>30} |", set.name);
        }
        out.push('\n');
        for row in self.worth.chunks(self.sets.len().max(1)) {
            let _ = write!(
                out,
                "| {:<9} | {:>5} | {:<8} | {:>4} |",
                row[0].images, row[0].noise, row[0].decoder, row[0].m
            );
            for (index, cell) in row.iter().enumerate() {
                let gain = if index == 0 {
                    String::new()
                } else {
                    format!(" {:+.3} ± {:.3}", cell.gain, cell.gain_se)
                };
                let _ = write!(out, " {:>30} |", format!("{:.3} ± {:.3}{gain}", cell.iou, cell.iou_se));
            }
            out.push('\n');
        }
    }
}
