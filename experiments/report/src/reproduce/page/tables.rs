//! Tables of the page.

use super::super::curves::BothSkins;
use super::super::results::SkinResults;
use super::super::tables::{CorrelationRow, REAL, TWIN, skin_file};
use crate::Table;
use crate::labels::object_label;
use spts_eval::decoders::label;

/// Numbers of measurements shown in the table of mean scores; its files have all.
const SHOWN: [usize; 7] = [5, 7, 10, 20, 25, 50, 100];

/// Table of the mean scores.
pub(super) fn means(skins: &BothSkins<'_>) -> Table {
    let compared = skins.real.is_some();
    let mut rows = Vec::new();
    let mut add = |name: &str, results: &SkinResults, object: &str| {
        let skin = compared.then(|| name.to_owned());
        let row = |words: [String; 2], scores: &[f64], blank: usize| -> Vec<String> {
            let numbers = scores.iter().map(|v| format!("{v:.3}"));
            let cells = skin.clone().into_iter().chain(words).chain(numbers);
            cells.chain((0..blank).map(|_| "–".to_owned())).collect()
        };
        let scored = results.scores.rows.iter().filter(|r| r.object == object);
        for r in scored.filter(|r| SHOWN.contains(&r.m)) {
            let scores = [
                r.support,
                r.iou,
                r.f1,
                r.balanced_accuracy,
                r.class_single,
                r.class_vote20,
            ];
            rows.push(row([label(r.decode).to_owned(), r.m.to_string()], &scores, 0));
        }
        for b in results.scores.baselines.iter().filter(|b| b.object == object) {
            let scores = [b.support, b.iou, b.f1, b.balanced_accuracy];
            rows.push(row([label(b.baseline).to_owned(), "0".to_owned()], &scores, 2));
        }
    };
    add("twin", skins.twin, skins.common());
    if let Some(real) = skins.real {
        add("real skin", real, skins.common());
        add("twin, all 17 objects", skins.twin, "mean");
    }
    let header = [
        "decoder",
        "M",
        "mean support accuracy",
        "mean IoU",
        "mean F1",
        "mean balanced accuracy",
        "single windows",
        "votes of 20",
    ];
    let caption = if compared {
        "Means over the objects that both skins recorded in compressed form, and over all 17 objects of the twin"
    } else {
        "Means over the 17 objects"
    };
    let skin = compared.then_some("skin");
    let whose = std::iter::once(TWIN).chain(compared.then_some(REAL));
    let files = whose.flat_map(|whose| [skin_file("scores", whose), skin_file("baselines", whose)]);
    Table {
        caption: caption.to_owned(),
        header: skin.into_iter().chain(header).map(str::to_owned).collect(),
        rows,
        files: files.collect(),
    }
}

/// How alike the raster images are.
pub(super) fn correlations(rows: &[CorrelationRow]) -> Table {
    let row = |c: &CorrelationRow| vec![object_label(&c.object).to_owned(), format!("{:.3}", c.pearson_r)];
    Table {
        caption: "Correlation (Pearson's r) of the twin's and the real skin's median raster images".to_owned(),
        header: vec!["object".to_owned(), "r".to_owned()],
        rows: rows.iter().map(row).collect(),
        files: vec!["raster_correlation.csv".to_owned()],
    }
}
