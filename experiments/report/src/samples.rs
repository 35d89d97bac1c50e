//! A page of made-up numbers, for tests.

use super::{Card, Page, PageFigure, Section, Table};

/// Strings from literals.
fn cells(row: &[&str]) -> Vec<String> {
    row.iter().map(|&cell| cell.to_owned()).collect()
}

/// A page with every kind of content, clearly synthetic.
pub(crate) fn page() -> Page {
    let card = |label: &str, twin: &str, real: Option<&str>, paper: Option<&str>| Card {
        label: label.to_owned(),
        of: "twin".to_owned(),
        value: twin.to_owned(),
        others: [("real skin", real), ("paper", paper)]
            .into_iter()
            .filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned())))
            .collect(),
        note: "made-up numbers".to_owned(),
    };
    let section = |id: &str, title: &str, figures: &[&str], tables: Vec<Table>| Section {
        id: id.to_owned(),
        title: title.to_owned(),
        lead: "Synthetic data, drawn to check the layout of a section; nothing here was measured or simulated."
            .to_owned(),
        figures: figures
            .iter()
            .map(|stem| {
                PageFigure::new(
                    *stem,
                    format!("Made-up curves “{stem}”"),
                    format!("Synthetic figure “{stem}” with a caption of a usual length."),
                )
            })
            .collect(),
        tables,
    };
    let table = Table {
        caption: "Made-up accuracy <by object & skin>".to_owned(),
        header: cells(&["object", "M", "twin (%)", "sensor (%)", "difference"]),
        rows: vec![
            cells(&["ball", "13", "81.2", "79.9", "+1.3"]),
            cells(&["“T”", "20", "97.0", "–", "−1.0"]),
            cells(&["cup, upside down", "100", "98.8 ± 0.4", "99.1", "−0.3"]),
        ],
        files: vec!["accuracy".to_owned()],
    };
    Page {
        title: "Single-pixel tactile skin: the twin against the sensor (synthetic page)".to_owned(),
        summary: "A page of made-up numbers.\n\nIt shows what the report looks like.".to_owned(),
        cards: vec![
            card("Classification at M = 20", "97.4 %", Some("96.1 %"), Some("≥ 98 %")),
            card("Frame rate at M = 20", "3500 Hz", None, Some("3500 Hz")),
            card("Localisation at M = 7", "1.4 px", Some("1.8 px"), Some("≤ 2 px")),
            card("Contact time of a ball", "7.9 ms", Some("8.1 ms"), None),
        ],
        sections: vec![
            section(
                "fig3",
                "Reconstruction and classification",
                &["two", "three"],
                vec![table.clone()],
            ),
            section("fig4", "Adaptive reconstruction", &["adaptive", "objects.png"], vec![]),
            section("fig5", "A bouncing ball", &["bounce", "one", "awkward"], vec![table]),
        ],
        glossary: vec![("taxel".to_owned(), "one touch-sensitive element of the skin".to_owned())],
        provenance: vec![
            ("seed".to_owned(), "1".to_owned()),
            ("data".to_owned(), "none: this page is synthetic".to_owned()),
        ],
    }
}
