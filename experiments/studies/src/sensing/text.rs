//! A design to read.

use super::design::DesignReport;

impl DesignReport {
    /// A few lines.
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
