//! The main figures at the top of the page.

use super::super::headline::Headline;
use crate::Card;
use crate::labels::object_list;
use spts_eval::decoders::label;

/// Number with `digits` decimals, or `None` for none.
fn number(value: Option<f64>, digits: usize) -> Option<String> {
    value.filter(|v| v.is_finite()).map(|v| format!("{v:.digits$}"))
}

/// A number of the page with its unit behind it.
struct Quantity {
    digits: usize,
    unit: &'static str,
}

impl Quantity {
    fn text(&self, value: Option<f64>) -> Option<String> {
        number(value, self.digits).map(|text| format!("{text}{}", self.unit))
    }
}

/// A card; none without a value. What is not known is left out.
fn card(label: &str, of: &str, value: Option<String>, others: &[(&str, Option<String>)], note: String) -> Option<Card> {
    let known = others
        .iter()
        .filter_map(|(whose, value)| Some(((*whose).to_owned(), value.clone()?)));
    Some(Card {
        label: label.to_owned(),
        of: of.to_owned(),
        value: value?,
        others: known.collect(),
        note,
    })
}

/// Words of the paper.
fn paper(text: &str) -> (&'static str, Option<String>) {
    ("paper", Some(text.to_owned()))
}

/// Every card that there are numbers for.
pub(super) fn cards(h: &Headline) -> Vec<Card> {
    let all = distances(h).into_iter().chain(scores(h)).chain(mechanics(h));
    all.flatten().collect()
}

/// How far the twin is from the skin, object by object.
fn distances(h: &Headline) -> Vec<Option<Card>> {
    let Some(skins) = h.per_object_skins else {
        return Vec::new();
    };
    let share = Quantity { digits: 3, unit: "" };
    let outside = object_list(h.iou_m20_matched_outside.as_deref().unwrap_or_default());
    let outside = if outside.is_empty() {
        "Every object of the real skin lies within the band of the simulated skins.".to_owned()
    } else {
        format!("Outside the band of the simulated skins: {outside}.")
    };
    vec![
        card(
            "Twin against real skin: overlap, M = 20",
            "mean difference, published decoder",
            share.text(h.iou_m20_matched_mean_abs_difference),
            &[
                (label("evidence"), share.text(h.iou_m20_evidence_mean_abs_difference)),
                (label("nn_lmmse"), share.text(h.iou_m20_nn_lmmse_mean_abs_difference)),
                ("two simulated skins", share.text(h.iou_m20_matched_between_skins)),
            ],
            format!(
                "Mean over the objects of the difference in IoU, without its sign; {skins} simulated skins. {outside}"
            ),
        ),
        card(
            "Twin against real skin: classes, M = 20",
            "mean difference, published decoder",
            share.text(h.class_single_m20_matched_mean_abs_difference),
            &[(
                label("evidence"),
                share.text(h.class_single_m20_evidence_mean_abs_difference),
            )],
            "Mean over the objects of the difference in the share of single windows classified correctly.".to_owned(),
        ),
    ]
}

/// Scores of the decoders.
fn scores(h: &Headline) -> Vec<Option<Card>> {
    let share = Quantity { digits: 3, unit: "" };
    let taxels = Quantity {
        digits: 2,
        unit: " taxels",
    };
    let compared = h.support_m20_matched_real.is_some();
    let over = if compared {
        "mean over the objects that both skins recorded in compressed form"
    } else {
        "mean over the 17 objects"
    };
    vec![
        card(
            "Objects recognised, M = 20",
            "twin, published decoder",
            share.text(
                h.class_vote20_m20_matched_common_twin
                    .or(h.class_vote20_m20_matched_twin),
            ),
            &[
                (
                    "twin, evidence",
                    share.text(
                        h.class_vote20_m20_evidence_common_twin
                            .or(h.class_vote20_m20_evidence_twin),
                    ),
                ),
                ("real skin, published", share.text(h.class_vote20_m20_matched_real)),
                ("real skin, evidence", share.text(h.class_vote20_m20_evidence_real)),
                paper("≥ 0.98"),
            ],
            format!("Share of votes of 20 windows that name the right one of 17 objects; {over}."),
        ),
        card(
            "Overlap with the true contact, M = 20",
            "twin, published decoder",
            share.text(h.iou_m20_matched_common_twin.or(h.iou_m20_matched_twin)),
            &[
                (
                    "twin, evidence",
                    share.text(h.iou_m20_evidence_common_twin.or(h.iou_m20_evidence_twin)),
                ),
                ("real skin, published", share.text(h.iou_m20_matched_real)),
                ("real skin, evidence", share.text(h.iou_m20_evidence_real)),
            ],
            format!("Intersection over union (IoU) of the touched taxels; {over}."),
        ),
        card(
            "Taxels on the right side, M = 20",
            "twin, published decoder",
            share.text(h.support_m20_matched_common_twin.or(h.support_m20_matched_twin)),
            &[("real skin, published", share.text(h.support_m20_matched_real))],
            format!("Support accuracy, the paper's measure: touched and untouched taxels count alike; {over}."),
        ),
        card(
            "Place of a bouncing ball, M = 25",
            "twin, published decoder",
            taxels.text(h.localisation_px_m25_twin),
            &[
                ("real skin", taxels.text(h.localisation_px_m25_real)),
                paper("< 1 taxel"),
                ("always the middle, twin", taxels.text(h.localisation_px_middle_twin)),
                ("always the middle, real", taxels.text(h.localisation_px_middle_real)),
            ],
            "Mean distance of the estimated from the true centre of the contact.".to_owned(),
        ),
    ]
}

/// Mechanics and time.
fn mechanics(h: &Headline) -> Vec<Option<Card>> {
    let ms = Quantity { digits: 2, unit: " ms" };
    let newtons = Quantity { digits: 3, unit: " N" };
    let micros = Quantity {
        digits: 1, unit: " µs"
    };
    let least = number(h.raster_corr_min, 2).map_or_else(String::new, |r| format!(" The least is {r}."));
    let bounce = match (number(h.bounce_contact_ms_twin, 2), number(h.bounce_cor_twin, 3)) {
        (Some(contact), Some(restitution)) => {
            format!(
                " In the twin's mechanics the contact takes {contact} ms, and the ball keeps {restitution} of its speed (means)."
            )
        }
        _ => String::new(),
    };
    let off = number(h.press_plateau_error_max_n, 3).map_or_else(String::new, |n| {
        format!(" No press deviates by more than {n} N while it holds.")
    });
    vec![
        card(
            "Contact of the ball",
            "twin, median",
            ms.text(h.bounce_contact_recorded_ms_twin),
            &[
                ("real skin, median", ms.text(h.bounce_contact_ms_real)),
                paper("≈ 8 ms"),
            ],
            format!("As the recordings show it.{bounce}"),
        ),
        card(
            "Raster images, twin and real skin",
            "mean correlation r",
            number(h.raster_corr_mean, 2),
            &[],
            format!("Pearson's r over the taxels, mean over the objects.{least}"),
        ),
        card(
            "Press force",
            "twin, mean",
            newtons.text(h.press_plateau_n),
            &[],
            format!("The target is 20 N.{off}"),
        ),
        card(
            "Time of one decode, M = 25",
            "twin, median",
            micros.text(h.decode_us_m25_median),
            &[],
            "Published decoder on one thread of this machine, its matrix ready. To acquire 25 measurements takes 389 µs.".to_owned(),
        ),
    ]
}
