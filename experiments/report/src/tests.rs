//! Tests of the page.

use super::{MOST_UNFOLDED, Page, PageFigure, Section, Table, html};
use crate::figures::tests::check_markup;
use crate::samples;

/// HTML elements without an end tag.
const VOID: [&str; 3] = ["meta", "img", "source"];

/// The page without its style sheet, which is not markup.
fn markup(page: &Page) -> String {
    let text = html(page);
    let (before, rest) = text.split_once("<style>").unwrap();
    let (_, after) = rest.split_once("</style>").unwrap();
    format!("{before}{after}")
}

#[test]
fn page_is_well_formed_and_self_contained() {
    let text = markup(&samples::page());
    check_markup(&text, &VOID).unwrap();
    assert!(!text.contains("http") && !text.contains("<script"));
    assert!(html(&samples::page()).contains("prefers-color-scheme: dark"));
    assert!(text.contains("src=\"figures/two.svg\"") && text.contains("src=\"figures/objects.png\""));
    assert!(text.contains("href=\"figures/objects.svg\"") && text.contains("href=\"tables/accuracy.csv\""));
}

/// Glossary and provenance are in the navigation, and a figure has words of its own for those who cannot see it.
#[test]
fn navigation_leads_to_every_section() {
    let page = samples::page();
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
    let table = Table {
        caption: nasty.clone(),
        header: vec![nasty.clone()],
        rows: vec![vec![nasty.clone(), nasty.clone()]],
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
        cards: vec![super::Card {
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
    let mut page = samples::page();
    page.sections[0].tables[0].files = vec!["one.csv".to_owned(), "two".to_owned()];
    let text = markup(&page);
    assert!(text.contains("<a href=\"tables/one.csv\">CSV: one</a>"), "{text}");
    assert!(text.contains("<a href=\"tables/two.csv\">CSV: two</a>"), "{text}");
}

/// A long table is folded away with the number of its rows, a short one is not.
#[test]
fn long_tables_are_folded() {
    let mut page = samples::page();
    let table = &mut page.sections[0].tables[0];
    table.rows = vec![table.header.clone(); MOST_UNFOLDED];
    assert!(!markup(&page).contains("<details>"));
    let table = &mut page.sections[0].tables[0];
    table.rows.push(table.header.clone());
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
    let text = markup(&samples::page());
    assert!(text.contains("<td class=\"number\">98.8 ± 0.4</td>"));
    assert!(text.contains("<td class=\"number\">–</td>"));
    assert!(text.contains("<td>cup, upside down</td>"));
}
