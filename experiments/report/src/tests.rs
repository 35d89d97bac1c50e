//! Tests of the page.

use super::{Page, Section, Table, html};
use crate::figures::tests::check_markup;
use crate::samples;

/// HTML elements without an end tag.
const VOID: [&str; 2] = ["meta", "img"];

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
        file: Some(nasty.clone()),
    };
    let section = Section {
        id: nasty.clone(),
        title: nasty.clone(),
        lead: nasty.clone(),
        figures: vec![(nasty.clone(), nasty.clone())],
        tables: vec![table],
    };
    let page = Page {
        title: nasty.clone(),
        summary: nasty.clone(),
        cards: vec![super::Card {
            label: nasty.clone(),
            twin: nasty.clone(),
            real: Some(nasty.clone()),
            paper: Some(nasty.clone()),
            note: nasty.clone(),
        }],
        sections: vec![section],
        provenance: vec![(nasty.clone(), nasty)],
    };
    let text = markup(&page);
    assert!(!text.contains("<script"), "{text}");
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
