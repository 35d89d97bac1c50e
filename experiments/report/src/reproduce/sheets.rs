//! The report's picture sheets: the objects (S5), progressive reconstruction (4), examples (S4), dictionary (S6).

use super::dataset::SimulatedData;
use super::results::{BothSkins, SkinResults};
use super::tables::{CorrelationRow, median_image};
use crate::figures::{Sheet, Tile, TileRow};
use crate::labels::object_label;
use spts_eval::decoders::TrainedDecoder;
use spts_eval::protocol::Truth;
use spts_eval::{Press, ScoredSession, Scorer, idle_mean};
use spts_recon::Matrix;

/// Numbers of measurements of the progressive reconstruction.
const PROGRESS: [usize; 9] = [2, 3, 4, 5, 7, 9, 11, 13, 15];
/// Numbers of measurements of the examples.
const EXAMPLES: [usize; 6] = [5, 10, 20, 25, 50, 100];
/// Objects of the examples: those the published compressive recordings hold.
const EXAMPLE_OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];
/// Press and frame that are reconstructed: in the middle of the plateau.
const FRAME: usize = 560;
/// Atoms shown of a dictionary.
const ATOMS: usize = 40;

fn heat(values: &[f64], cols: usize, caption: String, outline: Option<Vec<bool>>) -> Tile {
    Tile::Heat { values: values.to_vec(), rows: values.len() / cols.max(1), cols, max: None, caption, outline }
}

fn find<'a>(results: &'a SkinResults, object: &str) -> Option<&'a ScoredSession> {
    results.skin.sessions.iter().find(|s| s.object == object)
}

/// The images of one window by its first measurements.
struct ShownWindow {
    /// Number of measurements of each image.
    images: Vec<(usize, Vec<f64>)>,
    y: Vec<f64>,
    truth: Truth,
}

impl ShownWindow {
    /// A window of the last press of `object`; `None` without one.
    fn new(results: &SkinResults, decoder: &TrainedDecoder, object: &str, measurements: &[usize]) -> Option<Self> {
        let session = find(results, object)?;
        let block = session.scored().last()?;
        let recording = session.compressive.as_ref()?;
        let longest = measurements.iter().copied().max()?;
        let start = FRAME * recording.measurements_per_frame();
        if start + longest > recording.blocks()[block].volts.len() {
            return None;
        }
        let press = Press::within(recording, block, start..start + longest, idle_mean(recording, block));
        let mut scorer = Scorer::new(decoder);
        let mut images = Vec::new();
        for &m in measurements {
            let answer = scorer.answers(&[press.window(0, m)?]).ok()?.pop()?;
            images.push((m, answer.image));
        }
        Some(Self { images, y: press.window(0, longest)?.y.to_vec(), truth: session.truth(block)?.truth })
    }

    fn images(&self, cols: usize) -> impl Iterator<Item = Tile> + '_ {
        let outline = || Some(self.truth.support.clone());
        let images = self.images.iter();
        images.map(move |(_, image)| heat(image, cols, String::new(), outline()))
    }

    /// The raster image.
    fn raster(&self, cols: usize) -> Tile {
        heat(&self.truth.image, cols, String::new(), None)
    }
}

/// Fig. S5: scene, pressure, the twin's raster image and the real one, object by object.
pub(super) fn objects(dataset: &SimulatedData, skins: &BothSkins<'_>, correlations: &[CorrelationRow]) -> Sheet {
    let cols = dataset.cols;
    let rows = dataset.objects.iter().map(|object| {
        let name = &object.session.object;
        let scene = match &object.picture {
            Ok(p) => Tile::Picture { width: p.width, height: p.height, rgb: p.rgb.clone(), caption: String::new() },
            Err(reason) => Tile::Text(format!("not rendered: {reason}")),
        };
        let peak_kpa = object.pressure_pa.iter().copied().fold(0.0, f64::max) * 1e-3;
        let twin = object.session.raster().map_or_else(Vec::new, median_image);
        let volts = |image: &[f64]| format!("peak {:.2} V", image.iter().copied().fold(0.0, f64::max));
        let mut tiles = vec![
            scene,
            heat(&object.pressure_pa, cols, format!("peak {peak_kpa:.0} kPa"), None),
            heat(&twin, cols, volts(&twin), None),
        ];
        if let Some(real) = skins.real {
            let raster = find(real, name).and_then(|s| s.raster.as_ref());
            tiles.push(raster.map_or(Tile::Empty, |raster| {
                let image = median_image(raster);
                let r = correlations.iter().find(|c| c.object == *name).map(|c| c.pearson_r);
                let caption = r.map_or_else(|| volts(&image), |r| format!("{}, r = {r:.2}", volts(&image)));
                heat(&image, cols, caption, None)
            }));
        }
        TileRow { label: object_label(name).to_owned(), tiles }
    });
    let mut titles = vec!["object", "pressure", "raster image"];
    if skins.real.is_some() {
        titles[2] = "raster image, twin";
        titles.push("raster image, real skin");
    }
    Sheet {
        title: "The 17 objects, pressed with 20 N".to_owned(),
        column_titles: titles.into_iter().map(str::to_owned).collect(),
        rows: rows.collect(),
        tile_px: 120,
    }
}

/// Fig. 4: images from the first 2 to 15 measurements, by the published decoder and by the best. The published
/// compressive recordings hold no T, so the rows of the real skin show another object.
pub(super) fn adaptive(skins: &BothSkins<'_>, cols: usize) -> Sheet {
    let mut rows = Vec::new();
    let mut add = |whose: &str, object: &str, results: &SkinResults| {
        let decoders = [Some(("published decoder", &results.matched)), results.shown()];
        let title = format!("{}{whose}", object_label(object));
        for (index, (name, decoder)) in decoders.into_iter().flatten().enumerate() {
            let Some(shown) = ShownWindow::new(results, decoder, object, &PROGRESS) else {
                continue;
            };
            if index == 0 {
                let bars = shown.images.iter().map(|(m, _)| Tile::Bars {
                    values: shown.y.clone(),
                    highlight: *m,
                    caption: String::new(),
                });
                rows.push(TileRow { label: format!("{title}: the wire"), tiles: bars.chain([Tile::Empty]).collect() });
            }
            rows.push(TileRow {
                label: format!("{title}: {name}"),
                tiles: shown.images(cols).chain([shown.raster(cols)]).collect(),
            });
        }
    };
    match skins.real {
        None => add("", "T", skins.twin),
        Some(real) => {
            add(", twin", "T", skins.twin);
            add(", twin", "rec", skins.twin);
            add(", real skin", "rec", real);
        }
    }
    let titles = PROGRESS.iter().map(|m| format!("M = {m}")).chain(["raster image".to_owned()]);
    Sheet {
        title: "Images from the first M of 15 measurements".to_owned(),
        column_titles: titles.collect(),
        rows,
        tile_px: 96,
    }
}

/// Fig. S4: reconstructions at several M, by the published decoder and by the best.
pub(super) fn examples(skins: &BothSkins<'_>, cols: usize) -> Sheet {
    let mut rows = Vec::new();
    for object in EXAMPLE_OBJECTS {
        for (results, whose, _) in skins.named() {
            let decoders = [Some(("published", &results.matched)), results.shown()];
            for (name, decoder) in decoders.into_iter().flatten() {
                let Some(shown) = ShownWindow::new(results, decoder, object, &EXAMPLES) else {
                    continue;
                };
                rows.push(TileRow {
                    label: format!("{}{whose}: {name}", object_label(object)),
                    tiles: [shown.raster(cols)].into_iter().chain(shown.images(cols)).collect(),
                });
            }
        }
    }
    let titles = ["raster image".to_owned()].into_iter().chain(EXAMPLES.iter().map(|m| format!("M = {m}")));
    Sheet { title: "Images at several M".to_owned(), column_titles: titles.collect(), rows, tile_px: 80 }
}

/// Fig. S6: dictionaries.
pub(super) fn dictionaries(skins: &BothSkins<'_>, cols: usize) -> Sheet {
    const ACROSS: usize = 10;
    let mut rows = Vec::new();
    let mut add = |name: &str, dictionary: &Matrix| {
        for first in (0..dictionary.ncols().min(ATOMS)).step_by(ACROSS) {
            let last = (first + ACROSS).min(dictionary.ncols());
            rows.push(TileRow {
                label: format!("{name}atoms {}–{last}", first + 1),
                tiles: (first..last).map(|k| heat(&signed(&dictionary.column(k)), cols, String::new(), None)).collect(),
            });
        }
    };
    let of_twin = &skins.twin.skin.learned.dictionary.atoms;
    match skins.real {
        None => add("", of_twin),
        Some(real) => {
            add("twin, ", of_twin);
            add("published, ", &real.skin.learned.dictionary.atoms);
        }
    }
    Sheet { title: "First atoms of the learned dictionary".to_owned(), column_titles: vec![], rows, tile_px: 72 }
}

/// An atom with the sign that makes its largest entry positive.
fn signed(atom: &[f64]) -> Vec<f64> {
    let largest = atom.iter().copied().fold(0.0_f64, |a, v| if v.abs() > a.abs() { v } else { a });
    atom.iter().map(|v| v * largest.signum()).collect()
}
