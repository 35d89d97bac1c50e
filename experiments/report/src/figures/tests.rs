//! Figures of made-up data: well formed, of the right size, and never a panic.

use super::canvas::{Canvas, TextStyle};
use super::colour::heat;
use super::{Chart, Claim, Series, Sheet, StatedRange, Style, Tile, TileRow, pressure_png, save_charts, save_sheet};
use spts_input::Refusal;
use std::path::Path;

/// Tags of a document, checked to open and close in pairs; text must hold no bare `&` and attributes be quoted.
pub(crate) fn check_markup(text: &str, void: &[&str]) -> Result<usize, String> {
    let (mut open, mut count, mut rest) = (Vec::new(), 0, text);
    while let Some(start) = rest.find('<') {
        let (before, tag) = rest.split_at(start);
        let end = tag.find('>').ok_or("a tag without an end")?;
        let body = &tag[1..end];
        rest = &tag[end + 1..];
        let entities = ["amp;", "lt;", "gt;", "quot;", "#39;"];
        if before.split('&').skip(1).any(|after| !entities.iter().any(|entity| after.starts_with(entity))) {
            return Err(format!("bare & in `{before}`"));
        }
        if body.matches('"').count() % 2 != 0 || body.contains('<') {
            return Err(format!("bad tag `{body}`"));
        }
        let name = body.trim_start_matches('/').split_whitespace().next().unwrap_or_default().to_owned();
        count += 1;
        if body.starts_with('/') {
            let last = open.pop();
            if last.as_ref() != Some(&name) {
                return Err(format!("`{name}` closes {last:?}"));
            }
        } else if !body.ends_with('/') && !body.starts_with('!') && !void.contains(&name.as_str()) {
            open.push(name);
        }
    }
    if open.is_empty() { Ok(count) } else { Err(format!("left open: {open:?}")) }
}

/// Writes `charts` and a sheet, and checks that their files are well formed and of one size.
fn check(name: &str, save: impl Fn(&Path) -> Result<(), Refusal>) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("figures");
    save(&folder).unwrap();
    let text = std::fs::read_to_string(folder.join("figure.svg")).unwrap();
    assert!(check_markup(&text, &[]).unwrap() > 4, "{name}");
    assert!(!text.contains("NaN") && !text.contains("inf\""), "{name}");
    let bytes = std::fs::read(folder.join("figure.png")).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{name}");
    let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) / 2;
    let size = format!("width=\"{}\" height=\"{}\"", side(16), side(20));
    assert!(text.contains(&size), "{name}: {size}");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn charts_are_well_formed() {
    let points = |title: &str, points: Vec<(f64, f64)>| Chart {
        title: title.to_owned(),
        x_log: true,
        y_log: title == "one point",
        series: vec![Series::new("made up", Style::Twin, 0, points)],
        ..Chart::default()
    };
    let awkward = [
        points("empty <&> list", vec![]),
        points("one point", vec![(7.0, 3.0)]),
        points("constant", vec![(1.0, 0.0), (10.0, 0.0), (100.0, 0.0)]),
        points("no number", vec![(f64::NAN, 1.0), (2.0, f64::INFINITY), (-3.0, 1.0), (0.0, 2.0)]),
        Chart::default(),
        Chart { y_range: Some((f64::NAN, 1.0)), claims: vec![claim("", None, None)], ..accuracy("claims") },
    ];
    for charts in [&awkward[..], &[], &[accuracy("one"), accuracy("other")]] {
        check("charts", |folder| save_charts(charts, folder, "figure"));
    }
}

fn claim(label: &str, x: Option<f64>, y: Option<f64>) -> Claim {
    Claim { label: label.to_owned(), x, y }
}

/// A chart of everything: made-up curves, spans, scatter, claims, a range and a published system.
fn accuracy(title: &str) -> Chart {
    let curve = |level: f64, rate: f64| {
        let counts = [2.0, 5.0, 10.0, 20.0, 50.0, 100.0_f64];
        counts.map(|m| (m, level * (1.0 - (-m / rate).exp()))).to_vec()
    };
    let styles = [Style::Twin, Style::Real, Style::Raster, Style::RasterReal, Style::Baseline];
    let styles = styles.into_iter().zip(0_u8..);
    let mut series: Vec<Series> = styles
        .map(|(style, k)| Series::new(format!("made up {k}"), style, k, curve(97.0 - f64::from(k), 7.0)))
        .collect();
    // the same curve again
    series.push(Series::new("the same", Style::Twin, 1, curve(97.0, 7.0)));
    series[0] = series[0]
        .clone()
        .with_spans(vec![(10.0, 60.0, 80.0)])
        .with_scatter(vec![(2.0, 10.0, 30.0), (100.0, 90.0, 99.0)]);
    Chart {
        title: title.to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: "accuracy (%)".to_owned(),
        x_log: true,
        y_range: Some((0.0, 105.0)),
        series,
        claims: vec![
            claim("paper: ≥ 98 % at M = 20", Some(20.0), Some(98.0)),
            claim("made-up level", None, Some(30.0)),
            claim("made-up column", Some(8.0), None),
        ],
        ranges: vec![StatedRange { label: "made-up range".to_owned(), from: 15.0, to: 20.0 }],
        published: vec![claim("made-up system", Some(50.0), Some(50.0))],
        ..Chart::default()
    }
}

fn heat_tile(values: Vec<f64>, (rows, cols): (usize, usize), max: Option<f64>, caption: &str) -> Tile {
    Tile::Heat {
        outline: Some(values.iter().map(|v| *v > 15.0).collect()),
        values,
        rows,
        cols,
        max,
        caption: caption.to_owned(),
    }
}

fn sheet(label: &str, rows: usize, tiles: Vec<Tile>) -> Sheet {
    let row = |k: usize| TileRow { label: format!("{label} {k}"), tiles: tiles.clone() };
    Sheet {
        title: "made up".to_owned(),
        column_titles: ["object", "wire", "raster scan"].map(str::to_owned).to_vec(),
        rows: (0..rows).map(row).collect(),
        tile_px: 50,
    }
}

#[test]
fn sheets_are_well_formed() {
    let values: Vec<f64> = (0..100).map(|k| 31.0 * (f64::from(k) * 0.3).sin()).collect();
    let tiles = vec![
        Tile::Picture { width: 64, height: 48, rgb: vec![160; 64 * 48 * 3], caption: String::new() },
        Tile::Bars { values: vec![0.4, -0.1, f64::NAN], highlight: 1, caption: "first 1 of 3".to_owned() },
        Tile::Text("words in a tile".to_owned()),
        Tile::Empty,
        heat_tile(values, (10, 10), None, "M = 10"),
    ];
    for sheet in [sheet("made-up object", 10, tiles.clone()), sheet("few", 2, tiles), Sheet::default()] {
        check("sheet", |folder| save_sheet(&sheet, folder, "figure"));
    }
}

#[test]
fn tiles_with_the_wrong_number_of_values_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let wrong = sheet("wrong", 1, vec![heat_tile(vec![1.0; 9], (2, 5), None, "")]);
    let said = save_sheet(&wrong, dir.path(), "wrong").unwrap_err().to_string();
    assert!(said.contains("9 values do not fill 2 × 5 cells"), "{said}");
    assert!(pressure_png(&[], 0, 0, "kPa", 1.0, "", &dir.path().join("x.png")).is_err());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn images_without_values_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    for values in [vec![f64::NAN; 6], vec![0.0; 6], vec![-1.0; 6], vec![1e-12, 0.0, 2e-12, f64::INFINITY, 1.0, 5.0]] {
        pressure_png(&values, 2, 3, "kPa", 1e-3, "made up", &dir.path().join("map.png")).unwrap();
        let heat = |max| heat_tile(values.clone(), (2, 3), max, "");
        let sheet = sheet("", 1, vec![heat(None), heat(Some(0.0)), heat(Some(f64::NAN))]);
        check("no values", |folder| save_sheet(&sheet, folder, "figure"));
    }
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let blocker = dir.path().join("file");
    std::fs::write(&blocker, "").unwrap();
    let error = save_charts(&[], &blocker, "chart").unwrap_err();
    assert!(error.to_string().contains("file"), "{error}");
}

/// Relative luminance (IEC 61966-2-1) rises with the value: the map reads the same in grey. Thirty-two steps, so
/// that a step is wider than the rounding of the darkest colours to bytes.
#[test]
fn heat_rises_in_luminance() {
    let linear = |c: u8| ((f64::from(c) / 255.0 + 0.055) / 1.055).powf(2.4);
    let luminance = |i: u32| {
        let c = heat(f64::from(i) / 32.0);
        0.2126 * linear(c.0) + 0.7152 * linear(c.1) + 0.0722 * linear(c.2)
    };
    for i in 0..32 {
        assert!(luminance(i) < luminance(i + 1), "step {i}: {} {}", luminance(i), luminance(i + 1));
    }
}

#[test]
fn text_is_escaped() {
    let mut canvas = Canvas::new(10.0, 10.0, "<script>");
    canvas.text((1.0, f64::NAN), "</text><b>", TextStyle::new(10.0, super::colour::INK));
    canvas.disc((f64::NAN, 0.0), 1.0, super::colour::INK);
    check_markup(&canvas.svg(), &[]).unwrap();
}
