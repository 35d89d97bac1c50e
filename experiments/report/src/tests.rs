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

/// A page with every kind of content, made up.
fn page() -> Page {
    let section = |id: &str, figures: &[&str]| Section {
        id: id.to_owned(),
        title: format!("Section {id}"),
        lead: "Nothing here was measured or simulated.".to_owned(),
        figures: figures
            .iter()
            .map(|stem| PageFigure::new(*stem, format!("Made-up curves “{stem}”"), "A caption."))
            .collect(),
        tables: vec![PageTable {
            caption: "Made-up accuracy <by object & skin>".to_owned(),
            table: TextTable {
                head: cells(&["object", "M", "twin (%)", "sensor (%)", "difference"]),
                rows: vec![
                    cells(&["“T”", "20", "97.0", "–", "−1.0"]),
                    cells(&["cup, upside down", "100", "98.8 ± 0.4", "99.1", "−0.3"]),
                ],
            },
            files: vec!["accuracy".to_owned()],
        }],
    };
    let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
    Page {
        title: "The twin against the sensor (synthetic page)".to_owned(),
        summary: "A page of made-up numbers.\n\nIt shows what the report looks like.".to_owned(),
        cards: vec![Card {
            label: "Classification at M = 20".to_owned(),
            of: "twin".to_owned(),
            value: "97.4 %".to_owned(),
            others: vec![pair("real skin", "96.1 %"), pair("paper", "≥ 98 %")],
            note: "made-up numbers".to_owned(),
        }],
        sections: vec![section("fig3", &["two", "three"]), section("fig4", &["objects.png"])],
        glossary: vec![pair("taxel", "one touch-sensitive element of the skin")],
        provenance: vec![pair("seed", "1")],
    }
}

#[test]
fn page_is_well_formed_and_self_contained() {
    let text = markup(&page());
    check_markup(&text, &VOID).unwrap();
    check_markup(&markup(&Page::default()), &VOID).unwrap();
    assert!(!text.contains("http") && !text.contains("<script"));
    assert!(html(&page()).contains("prefers-color-scheme: dark"));
    assert!(text.contains("src=\"figures/two.svg\"") && text.contains("src=\"figures/objects.png\""));
    assert!(text.contains("href=\"figures/objects.svg\"") && text.contains("href=\"tables/accuracy.csv\""));
    assert!(text.contains("<td class=\"number\">98.8 ± 0.4</td>") && text.contains("<td class=\"number\">–</td>"));
    assert!(text.contains("<td>cup, upside down</td>"));
}

/// Glossary and provenance are in the navigation, and a figure has words of its own for those who cannot see it.
#[test]
fn navigation_leads_to_every_section() {
    let page = page();
    let text = markup(&page);
    let ids = page.sections.iter().map(|s| s.id.as_str()).chain(["glossary", "provenance"]);
    for id in ids {
        let (link, place) = (format!("<a href=\"#{id}\">"), format!("<section id=\"{id}\""));
        assert!(text.contains(&link) && text.contains(&place), "{id}");
    }
    assert!(text.contains("alt=\"Made-up curves “two”\""));
}

/// An animation is one file, and a picture stands for it where nothing is to move.
#[test]
fn animations_are_shown_as_they_are() {
    let figure =
        PageFigure { still: Some("still.png".to_owned()), ..PageFigure::new("press.gif", "a press", "A press.") };
    assert!(figure.html().contains("prefers-reduced-motion: reduce)\" srcset=\"figures/still.png\""));
    assert!(figure.html().contains("src=\"figures/press.gif\" alt=\"a press\""));
    assert!(!figure.html().contains("svg"));
}

#[test]
fn text_cannot_become_markup() {
    let nasty = "\"><script>alert('&')</script>".to_owned();
    let table = PageTable {
        caption: nasty.clone(),
        table: TextTable { head: vec![nasty.clone()], rows: vec![vec![nasty.clone(), nasty.clone()]] },
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
    assert!(text.contains(&format!("<summary>All {} rows</summary>", MOST_UNFOLDED + 1)), "{text}");
    check_markup(&text, &VOID).unwrap();
}
