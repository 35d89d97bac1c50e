//! Made-up data for the tests.

use super::{Chart, Claim, Series, Sheet, Style, Tile, TileRow};

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
pub(super) fn accuracy(title: &str) -> Chart {
    Chart {
        title: title.to_owned(),
        x_label: "measurements M".to_owned(),
        y_label: "accuracy (%)".to_owned(),
        x_log: true,
        y_range: Some((0.0, 105.0)),
        series: vec![
            Series::new("twin, compressive", Style::Twin, 0, curve(97.0, 7.0)),
            Series::new("sensor, compressive", Style::Real, 0, curve(95.0, 9.0)),
            Series::new("twin, raster", Style::Raster, 0, curve(94.0, 17.0)),
            Series::new("sensor, raster", Style::RasterReal, 0, curve(92.0, 21.0)),
            Series::new("chance", Style::Baseline, 0, vec![(2.0, 5.9), (100.0, 5.9)]),
        ],
        claims: vec![
            claim("paper: ≥ 98 % at M = 20", Some(20.0), Some(98.0)),
            claim("paper: ≥ 80 % at M = 13", Some(13.0), Some(80.0)),
        ],
        ..Chart::default()
    }
}

/// Peak pressure against time, several M of one style.
pub(super) fn bounce() -> Chart {
    let pulse = |shift: f64, step: f64| {
        let times = (0..40).map(|i| shift + step * f64::from(i)).take_while(|t| *t < 10.0);
        times
            .map(|t| (t, 38.0 * (-((t - 4.5) / 1.8_f64).powi(2)).exp()))
            .collect()
    };
    Chart {
        title: "Peak pressure in one bounce (synthetic)".to_owned(),
        x_label: "time (ms)".to_owned(),
        y_label: "peak pressure (kPa)".to_owned(),
        series: vec![
            Series::new("twin, M = 25", Style::Twin, 0, pulse(0.1, 0.35)),
            Series::new("twin, M = 50", Style::Twin, 1, pulse(0.3, 0.7)),
            Series::new("twin, M = 75", Style::Twin, 2, pulse(0.5, 1.05)),
            Series::new("twin, M = 100", Style::Twin, 3, pulse(0.7, 1.4)),
            Series::new("sensor, M = 25", Style::Real, 0, pulse(0.25, 0.36)),
            Series::new("sensor, M = 50", Style::Real, 1, pulse(0.25, 0.72)),
            Series::new("sensor, M = 100", Style::Real, 2, pulse(0.25, 1.44)),
        ],
        claims: vec![
            claim("paper: contact of 8 ms", Some(8.0), None),
            claim("made-up level", None, Some(30.0)),
        ],
        ..Chart::default()
    }
}

/// A made-up bump on a 10 × 10 grid, with its support.
pub(super) fn bump(row: f64, col: f64, width: f64) -> (Vec<f64>, Vec<bool>) {
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
pub(super) fn objects(count: u32) -> Sheet {
    let picture = |shade: u8| Tile::Picture {
        width: 64,
        height: 48,
        rgb: (0..64 * 48)
            .flat_map(|i: u32| [shade, u8::try_from(i % 64 * 4).unwrap(), 160])
            .collect(),
        caption: String::new(),
    };
    let row = |i: u32| TileRow {
        label: format!("made-up object {}", i + 1),
        tiles: std::iter::once(picture(u8::try_from(i * 14 % 255).unwrap()))
            .chain(
                [("M = 10", 3.6), ("M = 25", 3.1), ("M = 50", 2.8), ("raster", 2.6)]
                    .map(|(caption, width)| heat_tile(3.0 + f64::from(i % 4), 3.0 + f64::from(i % 5), width, caption)),
            )
            .collect(),
    };
    Sheet {
        title: "Reconstructions of 17 objects (synthetic)".to_owned(),
        column_titles: ["object", "M = 10", "M = 25", "M = 50", "raster scan"]
            .map(str::to_owned)
            .to_vec(),
        rows: (0..count).map(row).collect(),
        tile_px: 110,
    }
}

/// Bars above images, as in an adaptive reconstruction.
pub(super) fn adaptive() -> Sheet {
    let steps = [2, 5, 8, 11, 15];
    let volts: Vec<f64> = (0..15).map(|i| 0.4 + 0.5 * (f64::from(i) * 1.7).sin()).collect();
    let bars = steps.map(|m| Tile::Bars {
        values: volts.clone(),
        highlight: m,
        caption: format!("first {m} of 15"),
    });
    let images = [4.5, 3.8, 3.2, 2.9, 2.6].map(|width| heat_tile(4.0, 5.0, width, ""));
    let words = [Tile::Text("words in a tile".to_owned()), Tile::Empty];
    Sheet {
        title: "Images from more and more voltages (synthetic)".to_owned(),
        column_titles: steps.map(|m| format!("M = {m}")).to_vec(),
        rows: vec![
            TileRow {
                label: "voltages".to_owned(),
                tiles: bars.to_vec(),
            },
            TileRow {
                label: "tactile image".to_owned(),
                tiles: images.to_vec(),
            },
            TileRow {
                label: "other".to_owned(),
                tiles: words.to_vec(),
            },
        ],
        tile_px: 150,
    }
}

/// Awkward charts: nothing, one point, constants, not-a-number.
pub(super) fn awkward() -> Vec<Chart> {
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
