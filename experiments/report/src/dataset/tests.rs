//! Pictures of made-up rows and of shapes.

use super::preview::{MOST_PREVIEW_ROWS, layout};
use super::shapes::{self, height_at, picture, shade, share};
use super::{Preview, PreviewRow, drawn_shapes};
use crate::figures::canvas::{Canvas, text_width};
use serde_json::{Value, json};
use spts_contact::mesh::cuboid;
use spts_contact::shapes::SHAPE_FAMILIES;

/// Elements `tag` of a picture.
fn elements(canvas: &Canvas, tag: &str) -> Vec<String> {
    let start = format!("<{tag} ");
    canvas.svg().lines().filter(|line| line.starts_with(&start)).map(str::to_owned).collect()
}

/// A number among the attributes of an element.
fn attribute(element: &str, name: &str) -> f64 {
    let (_, rest) = element.split_once(&format!(" {name}=\"")).unwrap();
    rest.split_once('"').unwrap().0.parse().unwrap()
}

/// Texts of a picture.
fn texts(canvas: &Canvas) -> Vec<String> {
    let inside = |element: String| {
        let (_, rest) = element.split_once('>').unwrap();
        rest.split_once('<').unwrap().0.to_owned()
    };
    elements(canvas, "text").into_iter().map(inside).collect()
}

/// A row of a skin of `rows` × `cols` taxels, the first of which carries 12 kPa.
fn row(rows: usize, cols: usize) -> Value {
    let only_first = |value: f64| -> Vec<f64> { (0..rows * cols).map(|k| if k == 0 { value } else { 0.0 }).collect() };
    let support: Vec<bool> = (0..rows * cols).map(|k| k == 0).collect();
    json!({
        "index": 1_234_567, "split": "test", "pressure_pa": only_first(12e3), "support": support,
        "image_v": only_first(1.5), "y_v": [-0.5, 0.25], "object": "ring", "force_n": 7.25,
        "object_2": null, "force_n_2": null,
    })
}

#[test]
fn a_card_says_what_its_row_holds() {
    let card = |row: &Value, size| {
        let preview =
            Preview { name: "made-up".to_owned(), of: 2_000_000, rows: vec![PreviewRow::of(row, size).unwrap()] };
        layout(&preview)
    };
    let volts = card(&row(10, 10), (10, 10));
    for text in [
        "made-up: 1 of 2,000,000 rows",
        "row 1,234,567 · test",
        "ring 7.2 N",
        "0 to 12.0 kPa",
        "0 to 1.50 V",
        "2 samples: −0.500 to 0.250 V",
    ] {
        assert!(texts(&volts).contains(&text.to_owned()), "{text}: {:?}", texts(&volts));
    }
    let mut coded = row(3, 7);
    coded["y_v"] = Value::Null;
    coded["image_v"] = Value::Null;
    coded["y_code"] = json!([512, 17, 1023]);
    coded["object_2"] = json!("gear");
    coded["force_n_2"] = json!(40);
    let codes = card(&coded, (3, 7));
    for text in ["ring 7.2 N, gear 40.0 N", "3 codes: 17.0 to 1023", "0 to 12.0 kPa"] {
        assert!(texts(&codes).contains(&text.to_owned()), "{text}: {:?}", texts(&codes));
    }
    assert!(!texts(&codes).iter().any(|text| text.ends_with(" V")));
}

/// A map of a large skin has the means of its blocks: Σ p·A is kept.
#[test]
fn large_skins_are_drawn_in_blocks() {
    let large = PreviewRow::of(&row(300, 200), (300, 200)).unwrap();
    assert_eq!(large.size, (100, 67));
    assert!((large.pressure_kpa[0] - 12.0 / 9.0).abs() < 1e-12);
    assert_eq!(large.pressure_kpa.len(), 100 * 67);
    assert!(large.pressure_kpa[1..].iter().all(|p| p.abs() < 1e-12));
}

#[test]
fn a_row_that_does_not_fill_its_skin_is_refused() {
    let error = PreviewRow::of(&row(10, 10), (10, 11)).unwrap_err();
    assert_eq!(error.to_string(), "row 1234567: `image_v` has 100 values; 110 are needed");
    let none = PreviewRow::of(&json!({}), (2, 2)).unwrap_err();
    assert!(none.to_string().contains("`pressure_pa` has 0 values"), "{none}");
}

/// Every number of a card may be missing or the same as all others, and nothing is drawn outside the picture.
#[test]
fn odd_values_stay_on_the_card() {
    let mut odd = row(4, 4);
    odd["image_v"] = json!(vec![Value::Null; 16]);
    odd["y_v"] = json!([1.0, null, 1.0]);
    odd["pressure_pa"] = json!(vec![0.0; 16]);
    odd["object"] = json!("a name of a mesh file that is wider than its card by far, and then some");
    let preview = Preview { name: "odd".repeat(30), of: 1, rows: vec![PreviewRow::of(&odd, (4, 4)).unwrap()] };
    let canvas = layout(&preview);
    // the first rectangle is the paper
    for rect in elements(&canvas, "rect").iter().skip(1) {
        let far = |place, size| attribute(rect, place) + attribute(rect, size);
        assert!(attribute(rect, "x") >= 0.0 && attribute(rect, "y") >= 0.0, "{rect}");
        assert!(far("x", "width") <= canvas.width && far("y", "height") <= canvas.height, "{rect}");
    }
    for text in elements(&canvas, "text") {
        // a card of two maps is 208 wide; only the heading is beyond it
        let (at, size) = (attribute(&text, "x"), attribute(&text, "font-size"));
        let words = text.split_once('>').unwrap().1.split_once('<').unwrap().0;
        let width = text_width(words, size, text.contains("bold"));
        let least = if text.contains("middle") { at - width / 2.0 } else { at };
        let card = if attribute(&text, "y") < 95.0 { canvas.width } else { 16.0 + 208.0 };
        assert!(least >= 0.0 && least + width <= card, "{text}");
    }
}

/// The largest pictures are drawn to their last line: a side of a figure has 32,768 pixels at most, two to the unit.
#[test]
fn the_most_rows_fit() {
    for (side, raster) in [(10, true), (10, false), (40, true), (40, false)] {
        let mut full = row(side, side);
        for suffix in ["", "_2", "_3"] {
            full[&format!("object{suffix}")] = json!("a mesh of a long name of which no two fit a line of a card");
            full[&format!("force_n{suffix}")] = json!(40);
        }
        if !raster {
            full["image_v"] = Value::Null;
        }
        let shown = PreviewRow::of(&full, (side, side)).unwrap();
        let preview = Preview {
            name: "full".to_owned(),
            of: 1000,
            rows: vec![shown; usize::try_from(MOST_PREVIEW_ROWS).unwrap()],
        };
        let canvas = layout(&preview);
        assert!(2.0 * canvas.height <= 32_768.0, "{side}, {raster}: {}", canvas.height);
    }
}

/// The shade of a height is the height's own, and the scale's ends are its colours.
#[test]
fn heights_have_their_place_on_the_scale() {
    for height_m in [0.0, 0.1e-3, 0.3e-3, 1e-3, 4e-3, 20e-3] {
        assert!((height_at(share(height_m)) - height_m).abs() < 1e-15, "{height_m}");
    }
    assert!(share(0.0).abs() < 1e-15 && (share(20e-3) - 1.0).abs() < 1e-15 && (share(1.0) - 1.0).abs() < 1e-15);
    assert_ne!(shade(0.0), shade(0.1e-3));
}

/// A block of 6 mm × 3 mm in pixels of 1 mm: six columns and three rows of colour in the middle, x to the right.
#[test]
fn an_underside_has_its_size() {
    let rgb = picture(&cuboid([6e-3, 3e-3, 2e-3]), 9, 1e-3);
    let coloured = |row: usize, col: usize| rgb[(row * 9 + col) * 3..][..3] != [255; 3];
    let counted = (0..81).filter(|k| coloured(k / 9, k % 9)).count();
    // the middle of a pixel on an edge counts as inside
    assert!((18..=21).contains(&counted), "{counted}");
    assert!(coloured(4, 2) && coloured(4, 6) && coloured(3, 4) && coloured(5, 4));
    assert!(!coloured(2, 4) && !coloured(6, 4) && !coloured(4, 0) && !coloured(4, 8));
}

/// Shapes come evenly from the families, and the sheet names each family once.
#[test]
fn a_sheet_has_what_was_asked_for() {
    let families: Vec<_> = SHAPE_FAMILIES.iter().take(3).collect();
    let shapes = drawn_shapes(&families, 5, 11).unwrap();
    let drawn: Vec<_> = shapes.iter().map(|shape| (shape.family, shape.seed)).collect();
    let of = |family: usize, count: u64| (5..5 + count).map(move |number| (SHAPE_FAMILIES[family].name, number));
    assert_eq!(drawn, of(0, 4).chain(of(1, 4)).chain(of(2, 3)).collect::<Vec<_>>());
    let canvas = shapes::layout(&shapes);
    for family in families {
        let named = texts(&canvas).into_iter().filter(|text| text == family.name);
        assert_eq!(named.count(), 1, "{}", family.name);
    }
    assert_eq!(elements(&canvas, "image").len(), 11);
}
