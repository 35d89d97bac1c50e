//! Terms of the page.

use spts_eval::RASTER;
use spts_eval::decoders::label;

/// Terms that need the real skin.
const COMPARED: [(&str, &str); 2] = [
    (
        "band",
        "Where the score of one more simulated skin lies nine times in ten. Every simulated skin has taxels, mounting and noise of its own.",
    ),
    (
        "real skin",
        "The skin that the recordings were made with, published with the paper.",
    ),
];

/// Terms of every page.
const ALWAYS: [(&str, &str); 10] = [
    (
        "taxel",
        "One touch-sensitive element of the skin, as a pixel of an image. The skin has 10 × 10, 15 mm apart.",
    ),
    (
        "measurement",
        "One sample of the wire: the sum of all taxels, each with a weight of +1 or −1.",
    ),
    (
        "M",
        "How many measurements a decoder makes one image from. A raster scan needs 100.",
    ),
    ("window", "M measurements that follow each other, decoded together."),
    (
        "raster scan",
        "Reading the taxels one after another: the true image, and the slow way to get it.",
    ),
    (
        "support",
        "The touched taxels: those above 0.23 of the largest value of an image.",
    ),
    (
        "support accuracy",
        "Share of taxels that decoded and true image agree on, touched or not.",
    ),
    (
        "IoU",
        "Intersection over union: taxels touched in both the decoded and the true image, over those touched in either. 1 is perfect, 0 is no overlap.",
    ),
    ("vote of 20", "The object that most of 20 windows in a row name."),
    (
        "gain",
        "How much a taxel answers to a pressure. It differs from taxel to taxel by some 20 %, and a raster image shows it as mottle.",
    ),
];

/// Decoders and the control of every page, which stand there under their labels.
const SCORED: [(&str, &str); 4] = [
    (
        RASTER,
        "The control: M taxels of a raster scan, the others filled in between them. It takes as long as M measurements.",
    ),
    (
        "matched",
        "The published decoder with weights of ±1, as the skin has them, and the output without contact taken off. The published script uses weights of 0 and 1.",
    ),
    (
        "evidence",
        "A decoder that knows typical images of every object. It weighs which object explains the measurements best, and the image is the mean of what remains possible.",
    ),
    (
        "nn_lmmse",
        "Linear minimum mean square error with no negative pressure: a decoder that knows how touched taxels usually go together. It needs no object to be known.",
    ),
];

/// Terms, in the order of the alphabet.
pub(super) fn terms(compared: bool) -> Vec<(String, String)> {
    let more: &[_] = if compared { &COMPARED } else { &[] };
    let mut all: Vec<(String, String)> = ALWAYS
        .iter()
        .chain(more)
        .copied()
        .chain(SCORED.map(|(name, meaning)| (label(name), meaning)))
        .map(|(term, meaning)| (term.to_owned(), meaning.to_owned()))
        .collect();
    all.sort_by_key(|(term, _)| term.to_lowercase());
    all
}
