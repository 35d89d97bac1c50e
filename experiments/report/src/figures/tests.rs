//! Figures of made-up data: well formed, of the right size, and never a panic.

use super::colour::heat;
use super::draw::{Canvas, Shape, escape, svg};
use super::samples::{accuracy, adaptive, awkward, bounce, objects};
use super::{FigureError, Sheet, Tile, TileRow, pressure_png, save_charts, save_sheet};
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
    save_charts(&[accuracy("one"), bounce()], &folder, "two").unwrap();
    save_sheet(&objects(10), &folder, "objects").unwrap();
    save_sheet(&adaptive(), &folder, "adaptive").unwrap();
    save_sheet(&Sheet::default(), &folder, "empty").unwrap();
    let names = ["awkward", "none", "two", "objects", "adaptive", "empty"];
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
        matches!(
            error,
            FigureError::Shape {
                len: 9,
                rows: 2,
                cols: 5,
                ..
            }
        ),
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
    assert_eq!(
        escape("a<b & \"c\" 'd'\u{0}>"),
        "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;"
    );
    let mut canvas = Canvas::new(10.0, 10.0, "<script>");
    canvas.text(
        (1.0, f64::NAN),
        "</text><b>",
        super::draw::TextStyle::new(10.0, super::colour::INK),
    );
    canvas.items.push(Shape::Disc {
        centre: (f64::NAN, 0.0),
        radius: 1.0,
        fill: super::colour::INK,
    });
    check_markup(&svg(&canvas, Path::new("x.svg")).unwrap(), &[]).unwrap();
}
