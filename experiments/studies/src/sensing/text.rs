//! A design as text.

use super::design::RowDesignReport;
use super::report::SensingReport;

impl RowDesignReport {
    /// A summary in a few lines.
    #[must_use]
    pub fn text(&self) -> String {
        let [rows, cols] = self.skin;
        let mut out = format!(
            "{} rows of {} for {rows} × {cols} taxels\n\
             of the expected images' variance {:.1} % is left, with random signs {:.1} %\n\
             largest sum: {:.2} times that of a random row (root mean square); {:.0} % of the cells change from row to row\n",
            self.m,
            self.designer,
            100.0 * self.variance_left,
            100.0 * self.variance_left_random,
            self.largest_sum,
            100.0 * self.flips,
        );
        out.push_str(&match (self.bytes_a_cell, self.load_s) {
            (Some(bytes), Some(load_s)) => {
                format!(
                    "pattern: {bytes} bytes a cell, {:.1} ms for all at 400 kHz\n",
                    1e3 * load_s
                )
            }
            _ => "pattern: no cell holds it (at most 64 rows of ±1)\n".to_owned(),
        });
        out.push_str(if self.seeds_found {
            "seeds: there are some that begin with these rows\n"
        } else {
            "seeds: none (at most 24 rows of ±1)\n"
        });
        out
    }
}

/// Numbers of measurements of the printed table, where they were measured.
const SHOWN: [usize; 5] = [7, 13, 20, 25, 40];

impl SensingReport {
    /// IoU of every designer at some M, the equivalent numbers of random rows, and the cost.
    #[must_use]
    pub fn text(&self) -> String {
        let [rows, cols] = self.skin;
        let mut out = format!(
            "{rows} × {cols} taxels, {}; {} skins with {} touches of each kind. Mean IoU, 90 % band of the mean\n",
            self.decoder, self.skins, self.touches
        );
        let mut measurements: Vec<usize> = self.rows.iter().map(|r| r.m).collect();
        measurements.sort_unstable();
        measurements.dedup();
        if measurements.len() > SHOWN.len() {
            measurements.retain(|m| SHOWN.contains(m));
        }
        let mut last = ("", "");
        for row in self
            .rows
            .iter()
            .filter(|r| Some(&r.m) == self.rows.first().map(|first| &first.m))
        {
            if last != (row.touches, &row.readout) {
                last = (row.touches, &row.readout);
                out.push_str(&format!("\n{}, {}\n| {:<14} |", row.touches, row.readout, "rows"));
                measurements
                    .iter()
                    .for_each(|m| out.push_str(&format!(" {:^15} |", format!("M = {m}"))));
                out.push_str(" M = 20 is worth |\n|----------------|");
                measurements.iter().for_each(|_| out.push_str("-----------------|"));
                out.push_str("-----------------|\n");
            }
            out.push_str(&format!("| {:<14} |", row.designer));
            let own = |m: usize| {
                self.rows
                    .iter()
                    .find(|r| r.m == m && (r.touches, &*r.readout, r.designer) == (last.0, last.1, row.designer))
            };
            for &m in &measurements {
                let cell = own(m).map_or_else(String::new, |r| {
                    format!("{:.3} {:.2}–{:.2}", r.iou.mean, r.iou.low, r.iou.high)
                });
                out.push_str(&format!(" {cell:>15} |"));
            }
            let equal = self
                .equal
                .iter()
                .find(|e| e.m == 20 && (e.touches, &*e.readout, e.designer) == (last.0, last.1, row.designer));
            let worth = equal.map_or_else(String::new, |e| {
                e.random_m
                    .map_or_else(|| "beyond all".to_owned(), |m| format!("{m:.0} random"))
            });
            out.push_str(&format!(" {worth:>15} |\n"));
        }
        out.push_str(&self.classes_text(&measurements));
        out.push_str(&self.costs_text());
        out
    }

    fn classes_text(&self, measurements: &[usize]) -> String {
        let mut out = String::new();
        let mut last = "";
        let first = self.classes.first().map(|row| row.m);
        for row in self.classes.iter().filter(|row| Some(row.m) == first) {
            if last != row.readout {
                last = &row.readout;
                out.push_str(&format!(
                    "\nseventeen objects in their places, share classified, {last}\n| {:<14} |",
                    "rows"
                ));
                measurements
                    .iter()
                    .for_each(|m| out.push_str(&format!(" {:^15} |", format!("M = {m}"))));
                out.push_str("\n|----------------|");
                measurements.iter().for_each(|_| out.push_str("-----------------|"));
                out.push('\n');
            }
            out.push_str(&format!("| {:<14} |", row.designer));
            for m in measurements {
                let found = self
                    .classes
                    .iter()
                    .find(|r| (r.m, &*r.readout, r.designer) == (*m, last, row.designer));
                let cell = found.map_or_else(String::new, |r| {
                    let b = r.classified;
                    format!("{:.3} {:.2}–{:.2}", b.mean, b.low, b.high.min(1.0))
                });
                out.push_str(&format!(" {cell:>15} |"));
            }
            out.push('\n');
        }
        out
    }

    fn costs_text(&self) -> String {
        let Some(first) = self.costs.first() else {
            return String::new();
        };
        let mut out = format!(
            "\nerrors as shares of the samples' root mean square, M = {}, as_built; settling: as_designed\n\
             | {:<14} | {:<12} | flips | rms V | peak V | headroom |",
            first.m, "rows", "order"
        );
        first
            .errors
            .iter()
            .for_each(|e| out.push_str(&format!(" {:>13} |", e.cause)));
        out.push_str("\n|----------------|--------------|------:|------:|-------:|---------:|");
        first.errors.iter().for_each(|_| out.push_str("--------------:|"));
        out.push('\n');
        for row in &self.costs {
            out.push_str(&format!(
                "| {:<14} | {:<12} | {:>3.0} % | {:>5.2} | {:>6.2} | {:>8} |",
                row.designer,
                row.order,
                100.0 * row.flips,
                row.rms_v,
                row.peak_v,
                row.headroom().map_or_else(String::new, |h| format!("{h:.1} ×")),
            ));
            row.errors
                .iter()
                .for_each(|e| out.push_str(&format!(" {:>11.2} % |", 100.0 * e.share)));
            out.push('\n');
        }
        out
    }
}
