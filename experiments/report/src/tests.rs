//! Tests of the page.

use super::{Card, MOST_UNFOLDED, Page, PageFigure, PageTable, Section, TextTable, html};
use crate::figures::tests::check_markup;

/// HTML elements without an end tag.
const VOID: [&str; 3] = ["meta", "img", "source"];

/// The page without its style sheet, which is not markup.
fn markup(page: &Page) -> String {
    let text = html(page);
    let (before, rest) = text.split_once("<style>").unwrap();
    let (_, after) = rest.split_once("</style>").unwrap();
    format!("{before}{after}")
}

/// Strings from literals.
fn cells(row: &[&str]) -> Vec<String> {
    row.iter().map(|&cell| cell.to_owned()).collect()
}

/// A page with every kind of content, clearly synthetic.
fn page() -> Page {
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
    let section = |id: &str, title: &str, figures: &[&str], tables: Vec<PageTable>| Section {
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
    let table = PageTable {
        caption: "Made-up accuracy <by object & skin>".to_owned(),
        table: TextTable {
            head: cells(&["object", "M", "twin (%)", "sensor (%)", "difference"]),
            rows: vec![
                cells(&["ball", "13", "81.2", "79.9", "+1.3"]),
                cells(&["“T”", "20", "97.0", "–", "−1.0"]),
                cells(&["cup, upside down", "100", "98.8 ± 0.4", "99.1", "−0.3"]),
            ],
        },
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

#[test]
fn page_is_well_formed_and_self_contained() {
    let text = markup(&page());
    check_markup(&text, &VOID).unwrap();
    assert!(!text.contains("http") && !text.contains("<script"));
    assert!(html(&page()).contains("prefers-color-scheme: dark"));
    assert!(text.contains("src=\"figures/two.svg\"") && text.contains("src=\"figures/objects.png\""));
    assert!(text.contains("href=\"figures/objects.svg\"") && text.contains("href=\"tables/accuracy.csv\""));
}

/// Glossary and provenance are in the navigation, and a figure has words of its own for those who cannot see it.
#[test]
fn navigation_leads_to_every_section() {
    let page = page();
    let text = markup(&page);
    let ids = page
        .sections
        .iter()
        .map(|s| s.id.as_str())
        .chain(["glossary", "provenance"]);
    for id in ids {
        let (link, place) = (format!("<a href=\"#{id}\">"), format!("<section id=\"{id}\""));
        assert!(text.contains(&link) && text.contains(&place), "{id}");
    }
    assert!(text.contains("alt=\"Made-up curves “two”\""));
}

/// An animation is one file, and a picture stands for it where nothing is to move.
#[test]
fn animations_are_shown_as_they_are() {
    let figure = PageFigure {
        still: Some("still.png".to_owned()),
        ..PageFigure::new("press.gif", "a press", "A press.")
    };
    assert!(
        figure
            .html()
            .contains("prefers-reduced-motion: reduce)\" srcset=\"figures/still.png\"")
    );
    assert!(figure.html().contains("src=\"figures/press.gif\" alt=\"a press\""));
    assert!(!figure.html().contains("svg"));
}

#[test]
fn empty_page_is_well_formed() {
    check_markup(&markup(&Page::default()), &VOID).unwrap();
}

#[test]
fn text_cannot_become_markup() {
    let nasty = "\"><script>alert('&')</script>".to_owned();
    let table = PageTable {
        caption: nasty.clone(),
        table: TextTable {
            head: vec![nasty.clone()],
            rows: vec![vec![nasty.clone(), nasty.clone()]],
        },
        files: vec![nasty.clone(), nasty.clone()],
    };
    let section = Section {
        id: nasty.clone(),
        title: nasty.clone(),
        lead: nasty.clone(),
        figures: vec![PageFigure::new(nasty.clone(), nasty.clone(), nasty.clone())],
        tables: vec![table],
    };
    let page = Page {
        title: nasty.clone(),
        summary: nasty.clone(),
        cards: vec![Card {
            label: nasty.clone(),
            of: nasty.clone(),
            value: nasty.clone(),
            others: vec![(nasty.clone(), nasty.clone())],
            note: nasty.clone(),
        }],
        sections: vec![section],
        glossary: vec![(nasty.clone(), nasty.clone())],
        provenance: vec![(nasty.clone(), nasty)],
    };
    let text = markup(&page);
    assert!(!text.contains("<script"), "{text}");
    check_markup(&text, &VOID).unwrap();
}

/// A table whose rows are in several files links each by its name.
#[test]
fn every_file_of_a_table_is_linked() {
    let mut page = page();
    page.sections[0].tables[0].files = vec!["one.csv".to_owned(), "two".to_owned()];
    let text = markup(&page);
    assert!(text.contains("<a href=\"tables/one.csv\">CSV: one</a>"), "{text}");
    assert!(text.contains("<a href=\"tables/two.csv\">CSV: two</a>"), "{text}");
}

/// A long table is folded away with the number of its rows, a short one is not.
#[test]
fn long_tables_are_folded() {
    let mut page = page();
    let table = &mut page.sections[0].tables[0].table;
    table.rows = vec![table.head.clone(); MOST_UNFOLDED];
    assert!(!markup(&page).contains("<details>"));
    let table = &mut page.sections[0].tables[0].table;
    table.rows.push(table.head.clone());
    let text = markup(&page);
    assert!(
        text.contains(&format!("<summary>All {} rows</summary>", MOST_UNFOLDED + 1)),
        "{text}"
    );
    check_markup(&text, &VOID).unwrap();
}

/// Numbers are flush right, and a dash does not turn a column into words.
#[test]
fn columns_of_numbers_are_right_aligned() {
    let text = markup(&page());
    assert!(text.contains("<td class=\"number\">98.8 ± 0.4</td>"));
    assert!(text.contains("<td class=\"number\">–</td>"));
    assert!(text.contains("<td>cup, upside down</td>"));
}
