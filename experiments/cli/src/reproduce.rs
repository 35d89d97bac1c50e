//! `spts reproduce`: the whole report.

use crate::context::{Bars, Common, note_earlier};
use crate::error::CliError;
use crate::options::seed;
use clap::Args;
use spts_report::reproduce::{Reproduction, ReproductionSummary};
use std::path::PathBuf;

/// Simulates, learns, scores and draws everything, and writes a report that a browser shows.
///
/// Presses 17 objects and bounces a ball on the twin, and records them through the one-wire readout. The decoders'
/// dictionary and the classifier's library of example images are learned from the simulated raster images alone. The
/// same code then scores the twin and, with --recordings, the real skin.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts reproduce --quick --out out/look
  spts reproduce --recordings recordings/ --out out/report --seed 7
  spts reproduce --save-recordings --json

Files in DIR:
  index.html                  the report
  summary.json                its main numbers; timings.csv how long it took
  tables/*.csv                the numbers of all tables
  figures/*.svg, *.png        all figures
  arrays/*.npy                pressure_pa, median_raster_v, dictionary, library, library_labels
  sessions/                   with --save-recordings: a session folder for every object and for the ball")]
pub(super) struct ReproduceCommand {
    /// A short run of about a minute: few presses, few values of M
    #[arg(long)]
    quick: bool,
    /// Directory of recordings of the real skin to score beside the twin (see `spts validate --help`) [default: the
    /// twin alone]
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Folder of the report
    #[arg(long, value_name = "DIR", default_value = "out/report")]
    out: PathBuf,
    /// Root of every random number: of the skin's gains, the readout's noise, and the arm's deviations from press to
    /// press
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Also write the twin's recordings as session folders in DIR/sessions (about 70 MB, with --quick about 20 MB); see
    /// docs/session.md
    #[arg(long)]
    save_recordings: bool,
    #[command(flatten)]
    common: Common,
}

impl ReproduceCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        note_earlier(&self.out);
        let out = self.out.clone();
        let summary = Reproduction {
            seed: self.seed,
            quick: self.quick,
            recordings: self.recordings,
            out: self.out,
            save_recordings: self.save_recordings,
        }
        .run(&Bars::with_lines())?;
        let page = out.join("index.html");
        let text = || format!("{}\nreport: {}", text(&summary), page.display());
        self.common.print(&summary, text)
    }
}

/// Lines of the printed table: what, and the keys of the twin's number and the real skin's.
const LINES: [(&str, &[&str], &[&str]); 10] = [
    (
        "support accuracy, M = 20, matched",
        &["support_m20_matched_common_twin", "support_m20_matched_twin"],
        &["support_m20_matched_real"],
    ),
    ("IoU, M = 20, matched", &["iou_m20_matched_common_twin", "iou_m20_matched_twin"], &["iou_m20_matched_real"]),
    (
        "classification, vote of 20, M = 20",
        &["class_vote20_m20_matched_common_twin", "class_vote20_m20_matched_twin"],
        &["class_vote20_m20_matched_real"],
    ),
    ("localisation, M = 25, taxels", &["localisation_px_m25_twin"], &["localisation_px_m25_real"]),
    ("contact of the ball, recorded, ms", &["bounce_contact_recorded_ms_twin"], &["bounce_contact_ms_real"]),
    ("restitution of the ball", &["bounce_cor_twin"], &[]),
    ("raster images, r, mean", &["raster_corr_mean"], &[]),
    ("raster images, r, least", &["raster_corr_min"], &[]),
    ("press force on the plateau, N", &["press_plateau_n"], &[]),
    ("decode, M = 25, µs", &["decode_us_m25_median"], &[]),
];

fn text(summary: &ReproductionSummary) -> String {
    let h = &summary.headline;
    let show = |keys: &[&str]| h.first(keys).map_or_else(|| "–".to_owned(), |v| format!("{v:.3}"));
    let mut out = String::new();
    if let Some(skins) = h.number("per_object_skins") {
        out.push_str(&format!(
            "mean over the objects of |twin − real|, {skins} simulated skins, M = 20:\n\
             IoU: matched {}, nn_lmmse {}, evidence {}; single windows classified: matched {}, evidence {}\n\n",
            show(&["iou_m20_matched_mean_abs_difference"]),
            show(&["iou_m20_nn_lmmse_mean_abs_difference"]),
            show(&["iou_m20_evidence_mean_abs_difference"]),
            show(&["class_single_m20_matched_mean_abs_difference"]),
            show(&["class_single_m20_evidence_mean_abs_difference"]),
        ));
    }
    out.push_str(&format!("{:<38} {:>8} {:>8}\n", "", "twin", "real"));
    for (name, twin, real) in LINES {
        out.push_str(&format!("{name:<38} {:>8} {:>8}\n", show(twin), show(real)));
    }
    out.push_str(&format!("wall time {:.1} s", h.number("wall_s").unwrap_or_default()));
    out
}
