//! The most important numbers of a report: every one by its key, and the cards of the page that show them.

use super::dataset::SimulatedData;
use super::results::{BothSkins, MEAN_COMMON, SHOWN, SkinResults, TimingRow};
use super::tables::CorrelationRow;
use crate::Card;
use crate::labels::object_list;
use serde::{Serialize, Serializer};
use spts_eval::decoders::label;
use spts_eval::{Cell, ScoreRow};
use spts_recon::metrics::median;
use spts_sim::world::Bounce;
use spts_studies::per_object::{PerObjectReport, ScoreDistance};

/// What the numbers are taken from.
pub(super) struct Facts<'a> {
    pub(super) dataset: &'a SimulatedData,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) per_object: Option<&'a PerObjectReport>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) timings: &'a [TimingRow],
    pub(super) wall_s: f64,
}

/// M of the scores.
const M: usize = 20;
/// M of the localisation and of the decoding time.
const M_FAST: usize = 25;
const MATCHED: &str = "matched";
const SCRIPT: &str = "script_s20";

impl Facts<'_> {
    /// Scores of the twin at M = 20, means over `object`.
    fn twin(&self, decode: &str, object: &str) -> Option<&ScoreRow> {
        self.skins.twin.scores.row(object, decode, M)
    }

    /// Scores of the real skin at M = 20, means over its objects.
    fn real(&self, decode: &str) -> Option<&ScoreRow> {
        self.skins.real.and_then(|real| real.scores.row("mean", decode, M))
    }

    /// How far the twin is from the real skin, object by object, at M = 20.
    fn distance(&self, decode: &str, score: &str) -> Option<&ScoreDistance> {
        self.per_object.and_then(|found| found.distance(decode, M, score))
    }

    fn located(skin: Option<&SkinResults>) -> Option<f64> {
        skin.and_then(|skin| skin.scores.located(MATCHED, M_FAST))
            .map(|l| l.mean_px)
    }

    /// First bounce of every drop, from the mechanics.
    fn firsts(&self) -> impl Iterator<Item = &Bounce> {
        self.dataset.drops.iter().filter_map(|d| d.bounces.first())
    }

    /// Courses of the presses that held their target: plateau and its largest deviation, N.
    fn plateaus_n(&self) -> impl Iterator<Item = (f64, f64)> {
        let courses = self.dataset.objects.iter().flat_map(|o| o.courses.iter().flatten());
        courses.map(|c| (c.plateau_n, c.plateau_error_n))
    }

    fn pearson_r(&self) -> impl Iterator<Item = f64> {
        self.correlations.iter().map(|c| c.pearson_r)
    }
}

/// A number of the headline: its key, and where it is found.
type Entry = (&'static str, fn(&Facts<'_>) -> Cell);

/// Every number of the headline. Each key says score, M, decoder and skin. Means are over all objects of the skin:
/// seventeen for the twin, those with a compressive session for the real skin; `*_common_*` is the twin over the
/// latter. The first seven but one are means over the objects of |twin − real|, where the twin's score is a mean over
/// `per_object_skins` simulated skins, and `*_between_skins` is the same of one of the simulated skins in place of the
/// real one.
#[rustfmt::skip] // one line a number
const HEADLINE: &[Entry] = &[
    ("per_object_skins", |f| f.per_object.map(|found| found.skins).into()),
    ("iou_m20_matched_mean_abs_difference", |f| f.distance(MATCHED, "iou").map(|d| d.mean_abs_difference).into()),
    ("iou_m20_matched_between_skins", |f| f.distance(MATCHED, "iou").map(|d| d.between_skins).into()),
    // objects whose real score lies outside the band of the simulated skins, separated by spaces
    ("iou_m20_matched_outside", |f| f.distance(MATCHED, "iou").map(|d| d.outside.clone()).into()),
    ("iou_m20_nn_lmmse_mean_abs_difference", |f| {
        f.distance("nn_lmmse", "iou").map(|d| d.mean_abs_difference).into()
    }),
    ("iou_m20_evidence_mean_abs_difference", |f| f.distance(SHOWN, "iou").map(|d| d.mean_abs_difference).into()),
    ("class_single_m20_matched_mean_abs_difference", |f| {
        f.distance(MATCHED, "class_single").map(|d| d.mean_abs_difference).into()
    }),
    ("class_single_m20_evidence_mean_abs_difference", |f| {
        f.distance(SHOWN, "class_single").map(|d| d.mean_abs_difference).into()
    }),
    ("support_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.support).into()),
    ("support_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.support).into()),
    ("support_m20_matched_real", |f| f.real(MATCHED).map(|s| s.support).into()),
    ("support_m20_script_real", |f| f.real(SCRIPT).map(|s| s.support).into()),
    ("iou_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.iou).into()),
    ("iou_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.iou).into()),
    ("iou_m20_matched_real", |f| f.real(MATCHED).map(|s| s.iou).into()),
    ("class_vote20_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.class_vote20).into()),
    ("class_vote20_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_matched_real", |f| f.real(MATCHED).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_script_real", |f| f.real(SCRIPT).map(|s| s.class_vote20).into()),
    ("iou_m20_evidence_twin", |f| f.twin(SHOWN, "mean").map(|s| s.iou).into()),
    ("iou_m20_evidence_common_twin", |f| f.twin(SHOWN, MEAN_COMMON).map(|s| s.iou).into()),
    ("iou_m20_evidence_real", |f| f.real(SHOWN).map(|s| s.iou).into()),
    ("class_vote20_m20_evidence_twin", |f| f.twin(SHOWN, "mean").map(|s| s.class_vote20).into()),
    ("class_vote20_m20_evidence_common_twin", |f| f.twin(SHOWN, MEAN_COMMON).map(|s| s.class_vote20).into()),
    ("class_vote20_m20_evidence_real", |f| f.real(SHOWN).map(|s| s.class_vote20).into()),
    ("class_single_m20_matched_twin", |f| f.twin(MATCHED, "mean").map(|s| s.class_single).into()),
    ("class_single_m20_matched_common_twin", |f| f.twin(MATCHED, MEAN_COMMON).map(|s| s.class_single).into()),
    ("class_single_m20_matched_real", |f| f.real(MATCHED).map(|s| s.class_single).into()),
    ("localisation_px_m25_twin", |f| Facts::located(Some(f.skins.twin)).into()),
    ("localisation_px_m25_real", |f| Facts::located(f.skins.real).into()),
    // distance of the middle of the skin from the ball, which takes no measurement
    ("localisation_px_middle_twin", |f| f.skins.twin.middle_px(M_FAST).into()),
    ("localisation_px_middle_real", |f| f.skins.real.and_then(|r| r.middle_px(M_FAST)).into()),
    ("bounce_contact_ms_twin", |f| mean(f.firsts().map(|b| b.contact_s * 1e3)).into()),
    // contacts as a recording shows them, median
    ("bounce_contact_recorded_ms_twin", |f| f.skins.twin.contact_ms().into()),
    ("bounce_contact_ms_real", |f| f.skins.real.and_then(SkinResults::contact_ms).into()),
    ("bounce_cor_twin", |f| mean(f.firsts().map(Bounce::restitution)).into()),
    ("bounce_cor_max_twin", |f| {
        let all = f.dataset.drops.iter().flat_map(|d| &d.bounces);
        all.map(Bounce::restitution).reduce(f64::max).into()
    }),
    ("raster_corr_mean", |f| mean(f.pearson_r()).into()),
    ("raster_corr_min", |f| f.pearson_r().reduce(f64::min).into()),
    ("press_plateau_n", |f| mean(f.plateaus_n().map(|(n, _)| n)).into()),
    ("press_plateau_error_max_n", |f| f.plateaus_n().map(|(_, error_n)| error_n).reduce(f64::max).into()),
    ("presses_off_target", |f| {
        let courses = f.dataset.objects.iter().flat_map(|o| &o.courses);
        courses.filter(|c| c.is_none()).count().into()
    }),
    // largest |Σ p·A − force| / force over all frames of all presses and drops
    ("force_imbalance_max", |f| {
        let presses = f.dataset.objects.iter().map(|o| o.imbalance);
        presses.chain(f.dataset.drops.iter().map(|d| d.imbalance)).fold(0.0, f64::max).into()
    }),
    ("decode_us_m25_median", |f| {
        let times = f.timings.iter().filter(|t| t.m == M_FAST).map(|t| t.decode_us_median);
        median(&times.collect::<Vec<_>>()).into()
    }),
    ("wall_s", |f| f.wall_s.into()),
];

/// Mean of the finite values, or `None` without one.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for v in values.filter(|v| v.is_finite()) {
        sum += v;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// The most important numbers of a report by their keys; `null` in JSON where there is none, as without recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Headline(Vec<(&'static str, Cell)>);

impl Headline {
    pub(super) fn new(facts: &Facts<'_>) -> Self {
        Self(HEADLINE.iter().map(|(key, value)| (*key, value(facts))).collect())
    }

    fn cell(&self, key: &str) -> Option<&Cell> {
        let found = self.0.iter().find(|(known, _)| *known == key);
        debug_assert!(found.is_some(), "no number is called {key}");
        found.map(|(_, cell)| cell)
    }

    /// The number called `key`.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.cell(key)? {
            Cell::Number(value) => Some(*value),
            Cell::Whole(value) => Some(*value as f64),
            _ => None,
        }
    }

    /// The first number that there is.
    #[must_use]
    pub fn first(&self, keys: &[&str]) -> Option<f64> {
        keys.iter().find_map(|key| self.number(key))
    }

    fn words(&self, key: &str) -> &str {
        match self.cell(key) {
            Some(Cell::Text(words)) => words,
            _ => "",
        }
    }
}

impl Serialize for Headline {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, cell)| (key, cell)))
    }
}

/// A card of the page: a number of the headline beside what it is held against. Where several keys are given, the first
/// with a number counts; a card without a number is left out, and so is what is not known beside it.
struct CardLine {
    label: &'static str,
    of: &'static str,
    keys: &'static [&'static str],
    digits: usize,
    unit: &'static str,
    /// Whose number (a decoder by its name), and its keys.
    others: &'static [(&'static str, &'static [&'static str])],
    /// Words of the paper, after so many of the others.
    paper: Option<(usize, &'static str)>,
    note: fn(&Headline) -> String,
}

/// A card of a share, without words of the paper.
const SHARE: CardLine = CardLine {
    label: "",
    of: "twin, published decoder",
    keys: &[],
    digits: 3,
    unit: "",
    others: &[],
    paper: None,
    note: |_| String::new(),
};

/// Every card, in the order of the page.
const CARDS: &[CardLine] = &[
    CardLine {
        label: "Twin against real skin: overlap, M = 20",
        of: "mean difference, published decoder",
        keys: &["iou_m20_matched_mean_abs_difference"],
        others: &[
            ("evidence", &["iou_m20_evidence_mean_abs_difference"]),
            ("nn_lmmse", &["iou_m20_nn_lmmse_mean_abs_difference"]),
            ("two simulated skins", &["iou_m20_matched_between_skins"]),
        ],
        note: |h| {
            let outside = match object_list(h.words("iou_m20_matched_outside")) {
                none if none.is_empty() => {
                    "Every object of the real skin lies within the band of the simulated skins.".to_owned()
                }
                objects => format!("Outside the band of the simulated skins: {objects}."),
            };
            let skins = h.number("per_object_skins").unwrap_or(0.0);
            format!(
                "Mean over the objects of the difference in IoU, without its sign; {skins} simulated skins. {outside}"
            )
        },
        ..SHARE
    },
    CardLine {
        label: "Twin against real skin: classes, M = 20",
        of: "mean difference, published decoder",
        keys: &["class_single_m20_matched_mean_abs_difference"],
        others: &[("evidence", &["class_single_m20_evidence_mean_abs_difference"])],
        note: |_| {
            "Mean over the objects of the difference in the share of single windows classified correctly.".to_owned()
        },
        ..SHARE
    },
    CardLine {
        label: "Objects recognised, M = 20",
        keys: &["class_vote20_m20_matched_common_twin", "class_vote20_m20_matched_twin"],
        others: &[
            (
                "twin, evidence",
                &[
                    "class_vote20_m20_evidence_common_twin",
                    "class_vote20_m20_evidence_twin",
                ],
            ),
            ("real skin, published", &["class_vote20_m20_matched_real"]),
            ("real skin, evidence", &["class_vote20_m20_evidence_real"]),
        ],
        paper: Some((3, "≥ 0.98")),
        note: |h| {
            format!(
                "Share of votes of 20 windows that name the right one of 17 objects; {}.",
                over(h)
            )
        },
        ..SHARE
    },
    CardLine {
        label: "Overlap with the true contact, M = 20",
        keys: &["iou_m20_matched_common_twin", "iou_m20_matched_twin"],
        others: &[
            (
                "twin, evidence",
                &["iou_m20_evidence_common_twin", "iou_m20_evidence_twin"],
            ),
            ("real skin, published", &["iou_m20_matched_real"]),
            ("real skin, evidence", &["iou_m20_evidence_real"]),
        ],
        note: |h| format!("Intersection over union (IoU) of the touched taxels; {}.", over(h)),
        ..SHARE
    },
    CardLine {
        label: "Taxels on the right side, M = 20",
        keys: &["support_m20_matched_common_twin", "support_m20_matched_twin"],
        others: &[("real skin, published", &["support_m20_matched_real"])],
        note: |h| {
            format!(
                "Support accuracy, the paper's measure: touched and untouched taxels count alike; {}.",
                over(h)
            )
        },
        ..SHARE
    },
    CardLine {
        label: "Place of a bouncing ball, M = 25",
        keys: &["localisation_px_m25_twin"],
        digits: 2,
        unit: " taxels",
        others: &[
            ("real skin", &["localisation_px_m25_real"]),
            ("always the middle, twin", &["localisation_px_middle_twin"]),
            ("always the middle, real", &["localisation_px_middle_real"]),
        ],
        paper: Some((1, "< 1 taxel")),
        note: |_| "Mean distance of the estimated from the true centre of the contact.".to_owned(),
        ..SHARE
    },
    CardLine {
        label: "Contact of the ball",
        of: "twin, median",
        keys: &["bounce_contact_recorded_ms_twin"],
        digits: 2,
        unit: " ms",
        others: &[("real skin, median", &["bounce_contact_ms_real"])],
        paper: Some((1, "≈ 8 ms")),
        note: |h| {
            let [contact, restitution] = ["bounce_contact_ms_twin", "bounce_cor_twin"].map(|key| h.number(key));
            let mechanics = contact.zip(restitution).map_or_else(String::new, |(ms, cor)| {
                format!(
                    " In the twin's mechanics the contact takes {ms:.2} ms, and the ball keeps {cor:.3} of its speed (means)."
                )
            });
            format!("As the recordings show it.{mechanics}")
        },
    },
    CardLine {
        label: "Raster images, twin and real skin",
        of: "mean correlation r",
        keys: &["raster_corr_mean"],
        digits: 2,
        note: |h| {
            let least = h.number("raster_corr_min");
            let least = least.map_or_else(String::new, |r| format!(" The least is {r:.2}."));
            format!("Pearson's r over the taxels, mean over the objects.{least}")
        },
        ..SHARE
    },
    CardLine {
        label: "Press force",
        of: "twin, mean",
        keys: &["press_plateau_n"],
        unit: " N",
        note: |h| {
            let off = h.number("press_plateau_error_max_n").map_or_else(String::new, |n| {
                format!(" No press deviates by more than {n:.3} N while it holds.")
            });
            format!("The target is 20 N.{off}")
        },
        ..SHARE
    },
    CardLine {
        label: "Time of one decode, M = 25",
        of: "twin, median",
        keys: &["decode_us_m25_median"],
        digits: 1,
        unit: " µs",
        note: |_| {
            "Published decoder on one thread of this machine, its matrix ready. To acquire 25 measurements takes 389 µs."
                .to_owned()
        },
        ..SHARE
    },
];

/// What the scores are means over.
fn over(h: &Headline) -> &'static str {
    if h.number("support_m20_matched_real").is_some() {
        "mean over the objects that both skins recorded in compressed form"
    } else {
        "mean over the 17 objects"
    }
}

/// Every card that there are numbers for.
pub(super) fn cards(h: &Headline) -> Vec<Card> {
    let card = |line: &CardLine| {
        let text = |keys: &[&str]| {
            let value = h.first(keys).filter(|value| value.is_finite())?;
            Some(format!("{value:.*}{}", line.digits, line.unit))
        };
        let mut others: Vec<(String, Option<String>)> = line
            .others
            .iter()
            .map(|(whose, keys)| (label(whose).to_owned(), text(keys)))
            .collect();
        if let Some((place, words)) = line.paper {
            others.insert(place, ("paper".to_owned(), Some(words.to_owned())));
        }
        Some(Card {
            label: line.label.to_owned(),
            of: line.of.to_owned(),
            value: text(line.keys)?,
            others: others
                .into_iter()
                .filter_map(|(whose, value)| Some((whose, value?)))
                .collect(),
            note: (line.note)(h),
        })
    };
    CARDS.iter().filter_map(card).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every key of a card is one of the headline, and the others of a card stand before the paper's words.
    #[test]
    fn cards_show_numbers_of_the_headline() {
        let headline = Headline(HEADLINE.iter().map(|(key, _)| (*key, Cell::Number(0.5))).collect());
        let shown = cards(&headline);
        assert_eq!(shown.len(), CARDS.len());
        for (card, line) in shown.iter().zip(CARDS) {
            assert_eq!(
                card.others.len(),
                line.others.len() + usize::from(line.paper.is_some()),
                "{}",
                card.label
            );
        }
        let empty = Headline(HEADLINE.iter().map(|(key, _)| (*key, Cell::Unknown)).collect());
        assert!(cards(&empty).is_empty());
    }
}
