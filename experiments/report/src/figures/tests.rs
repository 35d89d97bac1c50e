//! Figures of made-up data: well formed, of the right size, and never a panic.

use super::canvas::{Canvas, TextStyle};
use super::colour::heat;
use super::{Chart, Claim, Series, Sheet, StatedRange, Style, Tile, TileRow, pressure_png, save_charts, save_sheet};
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
        if before
            .split('&')
            .skip(1)
            .any(|after| !entities.iter().any(|entity| after.starts_with(entity)))
        {
            return Err(format!("bare & in `{before}`"));
        }
        if body.matches('"').count() % 2 != 0 || body.contains('<') {
            return Err(format!("bad tag `{body}`"));
        }
        let name = body
            .trim_start_matches('/')
            .split_whitespace()
            .next()
            .unwrap_or_default()
            .to_owned();
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
    if open.is_empty() {
        Ok(count)
    } else {
        Err(format!("left open: {open:?}"))
    }
}

/// Width and height in the header of a PNG file (W3C PNG, §11.2.2).
fn png_size(path: &Path) -> (u32, u32) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{path:?}");
    assert_eq!(&bytes[bytes.len() - 8..bytes.len() - 4], b"IEND", "{path:?}");
    let word = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (word(16), word(20))
}

/// Every figure is written twice, at the size of its layout, with nothing left behind.
#[test]
fn figures_are_well_formed() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("figures");
    save_charts(&awkward(), &folder, "awkward").unwrap();
    save_charts(&[], &folder, "none").unwrap();
    save_charts(&[accuracy("one"), accuracy("other")], &folder, "two").unwrap();
    save_sheet(&objects(10), &folder, "objects").unwrap();
    save_sheet(&objects(2), &folder, "few").unwrap();
    save_sheet(&Sheet::default(), &folder, "empty").unwrap();
    let names = ["awkward", "none", "two", "objects", "few", "empty"];
    for name in names {
        let text = std::fs::read_to_string(folder.join(format!("{name}.svg"))).unwrap();
        assert!(check_markup(&text, &[]).unwrap() > 4, "{name}");
        let (width, height) = png_size(&folder.join(format!("{name}.png")));
        let size = format!("width=\"{}\" height=\"{}\"", width / 2, height / 2);
        assert!(text.contains(&size), "{name}: {size}");
        assert!(!text.contains("NaN") && !text.contains("inf\""), "{name}");
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2 * names.len());
}

#[test]
fn tiles_with_the_wrong_number_of_values_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let tile = Tile::Heat {
        values: vec![1.0; 9],
        rows: 2,
        cols: 5,
        max: None,
        caption: String::new(),
        outline: None,
    };
    let sheet = Sheet {
        rows: vec![TileRow {
            label: String::new(),
            tiles: vec![tile],
        }],
        tile_px: 50,
        ..Sheet::default()
    };
    let error = save_sheet(&sheet, dir.path(), "wrong").unwrap_err();
    assert!(
        error.to_string().contains("9 values do not fill 2 × 5 cells"),
        "{error}"
    );
    assert!(pressure_png(&[], 0, 0, "kPa", 1.0, "", &dir.path().join("x.png")).is_err());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

#[test]
fn images_without_values_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("map.png");
    for values in [
        vec![f64::NAN; 6],
        vec![0.0; 6],
        vec![-1.0; 6],
        vec![1e-12, 0.0, 2e-12, f64::INFINITY, 1.0, 5.0],
    ] {
        pressure_png(&values, 2, 3, "kPa", 1e-3, "made up", &path).unwrap();
        assert!(png_size(&path).0 > 500);
        let heat = |max| Tile::Heat {
            values: values.clone(),
            rows: 2,
            cols: 3,
            max,
            caption: String::new(),
            outline: None,
        };
        let tiles = vec![heat(None), heat(Some(0.0)), heat(Some(f64::NAN))];
        let sheet = Sheet {
            rows: vec![TileRow {
                label: String::new(),
                tiles,
            }],
            tile_px: 30,
            ..Sheet::default()
        };
        save_sheet(&sheet, dir.path(), "sheet").unwrap();
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
        assert!(
            luminance(i) < luminance(i + 1),
            "step {i}: {} {}",
            luminance(i),
            luminance(i + 1)
        );
    }
}

#[test]
fn text_is_escaped() {
    let mut canvas = Canvas::new(10.0, 10.0, "<script>");
    canvas.text((1.0, f64::NAN), "</text><b>", TextStyle::new(10.0, super::colour::INK));
    canvas.disc((f64::NAN, 0.0), 1.0, super::colour::INK);
    check_markup(&canvas.svg(), &[]).unwrap();
}

/// A saturating curve.
fn curve(level: f64, rate: f64) -> Vec<(f64, f64)> {
    let counts = [
        2.0, 3.0, 5.0, 7.0, 10.0, 13.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 75.0, 100.0_f64,
    ];
    counts.iter().map(|&m| (m, level * (1.0 - (-m / rate).exp()))).collect()
}

fn claim(label: &str, x: Option<f64>, y: Option<f64>) -> Claim {
    Claim {
        label: label.to_owned(),
        x,
        y,
    }
}

/// Accuracy against M, all skins.
fn accuracy(title: &str) -> Chart {
    Chart {
        title: title.to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: "accuracy (%)".to_owned(),
        x_log: true,
        y_range: Some((0.0, 105.0)),
        series: vec![
            Series::new("twin, compressive", Style::Twin, 0, curve(97.0, 7.0))
                .with_spans(vec![(10.0, 60.0, 80.0)])
                .with_scatter(vec![(2.0, 10.0, 30.0), (100.0, 90.0, 99.0)]),
            Series::new("twin, the same", Style::Twin, 1, curve(97.0, 7.0)),
            Series::new("sensor, compressive", Style::Real, 0, curve(95.0, 9.0)),
            Series::new("twin, raster", Style::Raster, 0, curve(94.0, 17.0)),
            Series::new("sensor, raster", Style::RasterReal, 0, curve(92.0, 21.0)),
            Series::new("chance", Style::Baseline, 0, vec![(2.0, 5.9), (100.0, 5.9)]),
        ],
        claims: vec![
            claim("paper: ≥ 98 % at M = 20", Some(20.0), Some(98.0)),
            claim("paper: ≥ 80 % at M = 13", Some(13.0), Some(80.0)),
            claim("made-up level", None, Some(30.0)),
            claim("made-up column", Some(8.0), None),
        ],
        ranges: vec![StatedRange {
            label: "made-up range".to_owned(),
            from: 15.0,
            to: 20.0,
        }],
        published: vec![claim("made-up system", Some(50.0), Some(50.0))],
        ..Chart::default()
    }
}

/// A made-up bump on a 10 × 10 grid, with its support.
fn bump(row: f64, col: f64, width: f64) -> (Vec<f64>, Vec<bool>) {
    let place = |i: u32| ((f64::from(i / 10) - row).hypot(f64::from(i % 10) - col)) / width;
    let values = (0..100).map(|i| (-place(i).powi(2)).exp() * 31.0 - 0.4).collect();
    (values, (0..100).map(|i| place(i) < 1.0).collect())
}

fn heat_tile(row: f64, col: f64, width: f64, caption: &str) -> Tile {
    let (values, support) = bump(row, col, width);
    Tile::Heat {
        values,
        rows: 10,
        cols: 10,
        max: None,
        caption: caption.to_owned(),
        outline: Some(support),
    }
}

/// Seventeen rows of pictures and tactile images.
fn objects(count: u32) -> Sheet {
    let picture = |shade: u8| Tile::Picture {
        width: 64,
        height: 48,
        rgb: (0..64 * 48)
            .flat_map(|i: u32| [shade, u8::try_from(i % 64 * 4).unwrap(), 160])
            .collect(),
        caption: String::new(),
    };
    let bars = |i: u32| Tile::Bars {
        values: (0..15).map(|k| 0.4 + 0.5 * (f64::from(k) * 1.7).sin()).collect(),
        highlight: i as usize,
        caption: format!("first {i} of 15"),
    };
    let row = |i: u32| TileRow {
        label: format!("made-up object {}", i + 1),
        tiles: [
            picture(u8::try_from(i * 14 % 255).unwrap()),
            bars(i),
            Tile::Text("words in a tile".to_owned()),
            Tile::Empty,
        ]
        .into_iter()
        .chain(
            [("M = 10", 3.6), ("M = 25", 3.1), ("M = 50", 2.8), ("raster", 2.6)]
                .map(|(caption, width)| heat_tile(3.0 + f64::from(i % 4), 3.0 + f64::from(i % 5), width, caption)),
        )
        .collect(),
    };
    Sheet {
        title: "Reconstructions of 17 objects (synthetic)".to_owned(),
        column_titles: [
            "object",
            "wire",
            "words",
            "",
            "M = 10",
            "M = 25",
            "M = 50",
            "raster scan",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: (0..count).map(row).collect(),
        tile_px: 110,
    }
}

/// Awkward charts: nothing, one point, constants, not-a-number.
fn awkward() -> Vec<Chart> {
    let with = |title: &str, points: Vec<(f64, f64)>| Chart {
        title: title.to_owned(),
        x_log: true,
        y_log: title == "one point",
        series: vec![Series::new("made up", Style::Twin, 0, points)],
        ..Chart::default()
    };
    vec![
        Chart {
            title: "empty <&> list".to_owned(),
            ..Chart::default()
        },
        with("no points", vec![]),
        with("one point", vec![(7.0, 3.0)]),
        with("constant", vec![(1.0, 0.0), (10.0, 0.0), (100.0, 0.0)]),
        with(
            "not a number",
            vec![(f64::NAN, 1.0), (2.0, f64::INFINITY), (-3.0, 1.0), (0.0, 2.0)],
        ),
        Chart {
            y_range: Some((f64::NAN, 1.0)),
            claims: vec![claim("", None, None)],
            ..accuracy("claims")
        },
    ]
}
