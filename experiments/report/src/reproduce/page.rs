//! The report's page.

use super::ReproductionSummary;
use super::figures::FIGURES;
use super::headline::Headline;
use super::results::SkinResults;
use super::tables::CorrelationRow;
use crate::{Card, Page, Section, Table};
use spts_eval::decoders::label;

/// Number with `digits` decimals, or a dash.
fn show(value: Option<f64>, digits: usize) -> String {
    value
        .filter(|v| v.is_finite())
        .map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
}

fn card(label: &str, twin: String, real: Option<String>, paper: Option<&str>, note: &str) -> Card {
    Card {
        label: label.to_owned(),
        twin,
        real,
        paper: paper.map(str::to_owned),
        note: note.to_owned(),
    }
}

fn cards(h: &Headline) -> Vec<Card> {
    let mut cards = distance_cards(h);
    cards.extend(score_cards(h));
    cards
}

/// How far the twin is from the skin, object by object; none without recordings.
fn distance_cards(h: &Headline) -> Vec<Card> {
    let Some(skins) = h.per_object_skins else {
        return Vec::new();
    };
    let outside = h.iou_m20_matched_outside.as_deref().unwrap_or_default();
    let outside = if outside.is_empty() { "none" } else { outside };
    vec![
        card(
            "|twin − real| of the IoU, M = 20",
            show(h.iou_m20_matched_mean_abs_difference, 3),
            None,
            None,
            &format!(
                "mean over the objects, matched decode, twin over {skins} simulated skins; one of these skins has {} to the others; outside the \
                 band: {outside}; nn_lmmse {}, evidence {}",
                show(h.iou_m20_matched_between_skins, 3),
                show(h.iou_m20_nn_lmmse_mean_abs_difference, 3),
                show(h.iou_m20_evidence_mean_abs_difference, 3)
            ),
        ),
        card(
            "|twin − real| of single windows classified, M = 20",
            show(h.class_single_m20_matched_mean_abs_difference, 3),
            None,
            None,
            &format!(
                "mean over the objects, matched decode; evidence {}",
                show(h.class_single_m20_evidence_mean_abs_difference, 3)
            ),
        ),
    ]
}

fn score_cards(h: &Headline) -> Vec<Card> {
    vec![
        card(
            "Support accuracy, M = 20",
            show(h.support_m20_matched_common_twin.or(h.support_m20_matched_twin), 3),
            Some(show(h.support_m20_matched_real, 3)),
            None,
            &format!(
                "matched decode; the twin over all 17 objects {}; real with the published script {}",
                show(h.support_m20_matched_twin, 3),
                show(h.support_m20_script_real, 3)
            ),
        ),
        card(
            "IoU of the support, M = 20",
            show(h.iou_m20_matched_common_twin.or(h.iou_m20_matched_twin), 3),
            Some(show(h.iou_m20_matched_real, 3)),
            None,
            &format!(
                "means over the objects, in which errors cancel; one simulated skin; the twin over all 17 objects {}",
                show(h.iou_m20_matched_twin, 3)
            ),
        ),
        card(
            "Classification, M = 20, vote of 20",
            show(
                h.class_vote20_m20_matched_common_twin
                    .or(h.class_vote20_m20_matched_twin),
                3,
            ),
            Some(show(h.class_vote20_m20_matched_real, 3)),
            Some("≥ 0.98"),
            &format!(
                "the twin over all 17 objects {}; real with the published script {}",
                show(h.class_vote20_m20_matched_twin, 3),
                show(h.class_vote20_m20_script_real, 3)
            ),
        ),
        card(
            "Localisation, M = 25",
            format!("{} taxels", show(h.localisation_px_m25_twin, 2)),
            Some(format!("{} taxels", show(h.localisation_px_m25_real, 2))),
            Some("< 1"),
            "mean distance of the estimated from the true centre of the ball's contact",
        ),
        card(
            "Contact of the ball, as recorded",
            format!("{} ms", show(h.bounce_contact_recorded_ms_twin, 2)),
            Some(format!("{} ms", show(h.bounce_contact_ms_real, 2))),
            Some("≈ 8 ms"),
            &format!(
                "medians; the twin's mechanics say {} ms, restitution {}",
                show(h.bounce_contact_ms_twin, 2),
                show(h.bounce_cor_twin, 3)
            ),
        ),
        card(
            "Raster images, twin against real",
            format!("r = {}", show(h.raster_corr_mean, 2)),
            None,
            None,
            &format!(
                "mean of Pearson's r over the objects; least {}",
                show(h.raster_corr_min, 2)
            ),
        ),
        card(
            "Press force",
            format!("{} N", show(h.press_plateau_n, 3)),
            None,
            None,
            &format!(
                "target 20 N; largest deviation on any plateau {} N; Σ p·A against the force within {:.0e}",
                show(h.press_plateau_error_max_n, 3),
                h.force_imbalance_max
            ),
        ),
        card(
            "Decoding, M = 25",
            format!("{} µs", show(h.decode_us_m25_median, 1)),
            None,
            None,
            "median of one matched decode on one thread of this machine, Φ·D given; acquiring takes 389 µs",
        ),
    ]
}

fn section(id: &str, title: &str, lead: &str) -> Section {
    let figures = FIGURES.iter().filter(|figure| figure.0 == id);
    Section {
        id: id.to_owned(),
        title: title.to_owned(),
        lead: lead.to_owned(),
        figures: figures.map(|f| (f.1.to_owned(), f.2.to_owned())).collect(),
        tables: vec![],
    }
}

/// Page of a reproduction. `means` is the table of mean scores (header and rows), `quick` whether it was a short run.
#[must_use]
pub(super) fn page(
    summary: &ReproductionSummary,
    means: Table,
    correlations: &[CorrelationRow],
    quick: bool,
    missing: &[String],
) -> Page {
    let headline = &summary.headline;
    let real = headline.support_m20_matched_real.is_some();
    let mut sections = vec![
        section(
            "objects",
            "The objects",
            "Seventeen meshed objects pressed with 20 N by a UR5: the scene, the pressure on the taxels, and the raster image \
             that the readout makes of it, beside the recorded one. Every image has its own colour scale.",
        ),
        section(
            "classification",
            "Classification and reconstruction",
            "Windows of M measurements are decoded with a dictionary and classified with a library. The twin's are learned \
             from simulated raster images only, the real skin's are the published ones. “Matched” means weights ±1 with the \
             idle output removed; the published script uses weights 0 and 1.",
        ),
        section(
            "adaptive",
            "Adaptive reconstruction",
            "More measurements refine the image. Cyan lines mark the support that is scored against: the taxels above 0.23 of the maximum of one raster frame, \
             which noise on a high background can pass too.",
        ),
        section(
            "bounce",
            "The bouncing ball",
            "A tennis ball dropped from half a metre on eight places. Contacts are found in the recordings of both skins in the \
             same way.",
        ),
    ];
    sections[1].tables.push(means);
    if !correlations.is_empty() {
        let rows = correlations
            .iter()
            .map(|c| vec![c.object.clone(), format!("{:.3}", c.pearson_r)]);
        sections[0].tables.push(Table {
            caption: "Pearson's r of the median raster images, twin against real".to_owned(),
            header: vec!["object".to_owned(), "r".to_owned()],
            rows: rows.collect(),
            file: Some("raster_correlation.csv".to_owned()),
        });
    }
    let mut text = String::from(
        "A digital twin of the single-pixel tactile skin: contact mechanics, foam and Velostat, the one-wire readout, and the \
         decoder.",
    );
    text.push_str(if real {
        " Beside it, the published recordings of the real skin, scored by the same code."
    } else {
        " No recordings of the real skin were given: pass --recordings DIR to see them beside the twin."
    });
    if quick {
        text.push_str(" This is a quick run: few presses and windows, so the scores scatter by a few per cent.");
    }
    if !missing.is_empty() {
        text.push_str(&format!(" {}", not_recorded(missing)));
    }
    Page {
        title: "The single-pixel tactile skin and its twin".to_owned(),
        summary: text,
        cards: cards(headline),
        sections,
        provenance: origin(summary),
    }
}

/// What is missing, entries of the form "object: what" joined by what they miss.
fn not_recorded(missing: &[String]) -> String {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for entry in missing {
        let (object, what) = entry.split_once(": ").unwrap_or((entry, ""));
        match groups.iter_mut().find(|(known, _)| *known == what) {
            Some((_, objects)) => objects.push(object),
            None => groups.push((what, vec![object])),
        }
    }
    let sentences = groups
        .iter()
        .map(|(what, objects)| format!("No {what} was given for {}.", objects.join(", ")));
    sentences.collect::<Vec<_>>().join(" ")
}

/// Numbers of measurements shown in the table of mean scores; the CSV has all.
const SHOWN: [usize; 7] = [5, 7, 10, 20, 25, 50, 100];

/// Table of the mean scores of both skins.
#[must_use]
pub(super) fn means_table(skins: &super::curves::BothSkins<'_>) -> Table {
    let mut rows = Vec::new();
    let mut add = |name: &str, results: &SkinResults, object: &str| {
        let scored = results.scores.rows.iter().filter(|r| r.object == object);
        for r in scored.filter(|r| SHOWN.contains(&r.m)) {
            let mut cells = vec![name.to_owned(), label(r.decode).to_owned(), r.m.to_string()];
            let scores = [
                r.support,
                r.iou,
                r.f1,
                r.balanced_accuracy,
                r.class_single,
                r.class_vote20,
            ];
            cells.extend(scores.map(|v| format!("{v:.3}")));
            rows.push(cells);
        }
        for b in results.scores.baselines.iter().filter(|b| b.object == object) {
            let mut cells = vec![name.to_owned(), label(b.baseline).to_owned(), "0".to_owned()];
            cells.extend([b.support, b.iou, b.f1, b.balanced_accuracy].map(|v| format!("{v:.3}")));
            cells.extend(["–".to_owned(), "–".to_owned()]);
            rows.push(cells);
        }
    };
    add("twin", skins.twin, skins.common());
    if let Some(real) = skins.real {
        add("real", real, skins.common());
        add("twin, all objects", skins.twin, "mean");
    }
    let header = [
        "skin",
        "decode",
        "M",
        "support",
        "IoU",
        "F1",
        "balanced",
        "single",
        "vote of 20",
    ];
    Table {
        caption: "Mean scores over the objects that both skins recorded compressively, and over all of the twin’s"
            .to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows,
        file: Some("scores_twin.csv".to_owned()),
    }
}

fn origin(summary: &ReproductionSummary) -> Vec<(String, String)> {
    let (p, m) = (&summary.provenance.provenance, &summary.provenance.machine);
    [
        ("seed", p.seed.to_string()),
        ("scenes", p.scene_hash.clone()),
        ("version", p.version.to_owned()),
        ("git revision", p.git_revision.clone()),
        ("MuJoCo", p.mujoco_version.to_owned()),
        ("processor", m.cpu.clone()),
        ("platform", m.platform.clone()),
        ("threads", m.threads.to_string()),
        ("wall time", format!("{:.0} s", summary.headline.wall_s)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
