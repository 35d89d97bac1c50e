//! Images for a skin without recordings: procedural shapes and objects in all poses, pressed in the simulation, and
//! outlines without one.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_dataset::{Maker, Spec};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams, VelostatConfig};
use spts_recon::Matrix;
use std::ops::Range;
use std::sync::Arc;

/// The data set of these shapes.
pub const SHAPES_SPEC: &str = "unseen-shapes";
/// Images for a sheet of 100 taxels: four hundred for each of the thirty clusters of a mixture.
const IMAGES: u64 = 12_000;
/// Taxels times images are as many as on 100 taxels: moments take the square of the taxels.
const VALUES: u64 = 100 * IMAGES;
/// Fewest images, on sheets of any size.
const FEWEST: u64 = 1_500;
/// One in so many presses has to touch the skin.
const LEAST_PRESSED: u64 = 4;
/// Presses that one maker makes: neighbours share a shape.
const CHUNK: u64 = 50;

/// Images of a skin of this `layout` (taxels × images) under the shapes of [`SHAPES_SPEC`], with equal gains of all
/// taxels, each scaled to a maximum of 1. A press gives all the images that the symmetries of the sheet make of it:
/// they are what the mirrored and turned shape would have given. With the images comes the family of each one's shape.
/// The result depends only on the layout and `seed`.
///
/// # Errors
/// [`Refusal`] if the layout is too large, or too small for the shapes to touch it.
pub fn shape_images(layout: &SkinLayout, seed: u64) -> Result<(Matrix, Vec<Arc<str>>), Refusal> {
    let images = (VALUES / layout.taxels().max(1) as u64).clamp(FEWEST, IMAGES);
    let symmetries = symmetries(layout.rows(), layout.cols());
    let presses = images.div_ceil(symmetries.len() as u64);
    let mut overrides = toml::Table::new();
    let skin = [
        ("rows", (layout.rows() as i64).into()),
        ("cols", (layout.cols() as i64).into()),
        ("pitch_m", layout.pitch_m().into()),
        ("electrode_m", layout.electrode_m().into()),
    ];
    let skin: toml::Table = skin.map(|(key, value): (&str, toml::Value)| (key.to_owned(), value)).into_iter().collect();
    overrides.insert("rows".to_owned(), (presses as i64).into());
    overrides.insert("seed".to_owned(), ((seed >> 2) as i64).into());
    overrides.insert("skin".to_owned(), skin.into());
    let spec = Spec::load(SHAPES_SPEC, &overrides)?;
    let chunks = (0..presses.div_ceil(CHUNK)).into_par_iter();
    // what lies beside a small skin is no image of it
    let pressed_in = |chunk: u64| {
        let mut maker = Maker::new(&spec);
        let rows = chunk * CHUNK..((chunk + 1) * CHUNK).min(presses);
        rows.filter_map(|row| scaled(&mut maker, row).ok()).collect::<Vec<_>>()
    };
    let pressed = chunks.map(pressed_in).collect::<Vec<_>>().concat();
    if (pressed.len() as u64) < presses / LEAST_PRESSED {
        return Err(Refusal::new(format!("{} of {presses} shapes touch the skin: it is too small", pressed.len())));
    }
    let columns = pressed.iter().flat_map(|(image, _)| {
        symmetries.iter().map(move |taxels| taxels.iter().map(|&taxel| image[taxel]).collect::<Vec<_>>())
    });
    let families = pressed.iter().flat_map(|(_, family)| symmetries.iter().map(move |_| Arc::clone(family)));
    Ok((Matrix::from_column_slices(layout.taxels(), &columns.collect::<Vec<_>>()), families.collect()))
}

/// The symmetries of a sheet of `rows` × `cols` taxels: for each of them, the taxel whose value every taxel takes. A
/// sheet has those of a rectangle, and a square one also those that swap rows and columns.
fn symmetries(rows: usize, cols: usize) -> Vec<Vec<usize>> {
    let all = (0..if rows == cols { 8 } else { 4 }).map(|kind: usize| {
        let flipped = |flip: usize, at: usize, of: usize| if kind & flip == 0 { at } else { of - 1 - at };
        let of_taxel = |taxel: usize| {
            let (row, col) = (flipped(1, taxel / cols, rows), flipped(2, taxel % cols, cols));
            if kind & 4 == 0 { row * cols + col } else { col * cols + row }
        };
        (0..rows * cols).map(of_taxel).collect::<Vec<_>>()
    });
    // a line of taxels has fewer
    let mut found: Vec<Vec<usize>> = Vec::new();
    all.for_each(|taxels| {
        if !found.contains(&taxels) {
            found.push(taxels);
        }
    });
    found
}

/// Conductances of `rows` of a data set, each as a share of its largest.
fn conductances(spec: &Spec, rows: Range<u64>) -> Result<Vec<Vec<f64>>, Refusal> {
    let mut maker = Maker::new(spec);
    rows.map(|row| scaled(&mut maker, row).map(|(image, _)| image)).collect()
}

/// Conductances of row `row` as a share of their largest, and the name of what is pressed.
fn scaled(maker: &mut Maker<'_>, row: u64) -> Result<(Vec<f64>, Arc<str>), Refusal> {
    let made = maker.row(row)?;
    let image = made.conductance().values();
    let peak = image.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    Ok((image.iter().map(|v| v / peak).collect(), made.name()))
}

/// How accurately the pose of an object is known: its place to half a taxel and its rotation to 15°, as read by eye;
/// its tilt is unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseKnowledge {
    /// Step to which a place is known along each axis, m.
    pub place_step_m: f64,
    /// Standard deviation of the place about the step, m.
    pub place_sd_m: f64,
    /// Step to which a rotation is known, degrees.
    pub rotation_step_deg: f64,
    /// Standard deviation of the rotation about the step, degrees.
    pub rotation_sd_deg: f64,
    /// Standard deviation of the tilt about each axis of the skin, degrees.
    pub tilt_sd_deg: f64,
}

impl Default for PoseKnowledge {
    fn default() -> Self {
        Self { place_step_m: 7.5e-3, place_sd_m: 4e-3, rotation_step_deg: 15.0, rotation_sd_deg: 5.0, tilt_sd_deg: 0.7 }
    }
}

/// Presses of each object.
const PRESSES_OF_AN_OBJECT: u64 = 600;
/// Pitch and middle of the sheet on which the objects' places are written down.
const PITCH_M: f64 = 0.015;
const MIDDLE: f64 = 4.5;

/// Simulated images of one object in many places, rotations and tilts, to learn from.
#[derive(Debug, Clone)]
pub struct PosedObject {
    /// Name.
    pub name: &'static str,
    /// Taxels × presses, with equal gains of all taxels; each image is scaled to a maximum of 1.
    pub images: Matrix,
}

impl PoseKnowledge {
    /// Images of all objects on a skin of this `layout`, at the same distances in metres from the middle. The result
    /// depends only on the layout and `seed`. `done` is called after every object.
    ///
    /// # Errors
    /// [`Refusal`] if the objects cannot be pressed there.
    pub fn press(&self, layout: &SkinLayout, seed: u64, done: &(dyn Fn() + Sync)) -> Result<Vec<PosedObject>, Refusal> {
        let objects = OBJECTS.par_iter().map(|object| {
            let streams = Streams::new(seed).rng("poses", u64::from(object.label));
            let images = self.press_one(object, layout, streams)?;
            done();
            Ok(PosedObject { name: object.name, images })
        });
        objects.collect()
    }

    fn press_one(&self, object: &ObjectSpec, layout: &SkinLayout, mut rng: impl rand::Rng) -> Result<Matrix, Refusal> {
        let placement = &object.placement;
        let to = |step: f64, value: f64| (value / step).round() * step;
        let x_m = to(self.place_step_m, (placement.col - MIDDLE) * PITCH_M);
        let y_m = to(self.place_step_m, (MIDDLE - placement.row) * PITCH_M);
        let rotation_deg = to(self.rotation_step_deg, placement.rotation_rad.to_degrees());
        let text = format!(
            "rows = {PRESSES_OF_AN_OBJECT}\nseed = {}\nreadout = \"ideal\"\n\
             [object]\nfrom = \"objects\"\nnames = [\"{}\"]\n\
             [pose]\nx_m = {{ normal = [{x_m:e}, {:e}] }}\ny_m = {{ normal = [{y_m:e}, {:e}] }}\n\
             rotation_deg = {{ normal = [{rotation_deg:e}, {:e}] }}\n\
             tilt_x_deg = {{ normal = [0.0, {tilt:e}] }}\ntilt_y_deg = {{ normal = [0.0, {tilt:e}] }}\n\
             [skin]\nrows = {}\ncols = {}\npitch_m = {:e}\nelectrode_m = {:e}\n\
             [transducer]\nspread_log_sd = 0.0\nsession_log_sd = 0.0\nsession_tilt_log_sd = 0.0\n\
             [record]\nmeasurements = 1\nraster = false\nlabels = []\n",
            rng.next_u64() >> 2,
            object.name,
            self.place_sd_m,
            self.place_sd_m,
            self.rotation_sd_deg,
            layout.rows(),
            layout.cols(),
            layout.pitch_m(),
            layout.electrode_m(),
            tilt = self.tilt_sd_deg,
        );
        let spec = Spec::from_toml(&text, &toml::Table::new(), ".".as_ref())?;
        let images = conductances(&spec, 0..PRESSES_OF_AN_OBJECT)?;
        Ok(Matrix::from_column_slices(layout.taxels(), &images))
    }
}

/// Random shapes in the prior. Their moments on 100 taxels change by less than 3 % when there are twice as many.
const SHAPES: usize = 1500;
/// Points along one side of a taxel at which a shape is sampled: its edges then fade over a taxel, as electrodes see
/// them.
const SAMPLES: usize = 3;
/// Half sizes of a shape as shares of the side of a square sheet with as many taxels.
const HALF_SIZES: [f64; 2] = [0.04, 0.4];
/// Smallest half size, taxels.
const SMALLEST: f64 = 0.7;
/// Widths of the blobs of the dictionary, taxels: standard deviations.
const WIDTHS: [f64; 2] = [0.8, 1.8];
/// With more taxels than this, the dictionary has blobs of the first width only.
const FEW_TAXELS: usize = 400;
/// Blobs end at this many standard deviations.
const REACH: f64 = 3.0;

/// Outline of a shape about its centre, in its own axes, for half sizes (a, b).
type Inside = fn(x: f64, y: f64, a: f64, b: f64) -> bool;

/// The outlines and their names.
const OUTLINES: [(&str, Inside); 5] = [
    ("ellipse", |x, y, a, b| (x / a).powi(2) + (y / b).powi(2) <= 1.0),
    ("plate", |x, y, a, b| x.abs() <= a && y.abs() <= b),
    ("ring", |x, y, a, b| {
        let r = ((x / a).powi(2) + (y / b).powi(2)).sqrt();
        (0.55..=1.0).contains(&r)
    }),
    ("cross", |x, y, a, b| (x.abs() <= a && y.abs() <= 0.3 * b) || (y.abs() <= b && x.abs() <= 0.3 * a)),
    ("angle", |x, y, a, b| x.abs() <= a && y.abs() <= b && (x < -0.3 * a || y < -0.3 * b)),
];

/// Images of random shapes on a skin of this layout, taxels × images, and the outline of each; a function of `streams`
/// alone.
pub(super) fn outline_images(layout: &SkinLayout, streams: Streams) -> (Matrix, Vec<Arc<str>>) {
    let gain_log_sd = VelostatConfig::default().spread_log_sd;
    let names = OUTLINES.map(|(name, _)| Arc::from(name));
    let each = (0..SHAPES as u64).map(|index| image(layout, gain_log_sd, &mut streams.rng("layout/shape", index)));
    let (images, outlines): (Vec<_>, Vec<_>) = each.map(|(image, k)| (image, Arc::clone(&names[k]))).unzip();
    (Matrix::from_column_slices(layout.taxels(), &images), outlines)
}

/// One shape, on taxels whose gains have logarithms with the standard deviation `gain_log_sd`, and its outline's place
/// in [`OUTLINES`].
fn image(layout: &SkinLayout, gain_log_sd: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, usize) {
    let (rows, cols) = (layout.rows(), layout.cols());
    // shapes that are wider than a strip still cover a length of it
    let side = ((rows * cols) as f64).sqrt().max(2.0);
    let mut uniform = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let mut half = || (side * HALF_SIZES[0] * (HALF_SIZES[1] / HALF_SIZES[0]).powf(uniform(0.0, 1.0))).max(SMALLEST);
    let (a, b) = (half(), half());
    let centre = [uniform(-0.5, rows as f64 - 0.5), uniform(-0.5, cols as f64 - 0.5)];
    let (sin, cos) = uniform(0.0, std::f64::consts::TAU).sin_cos();
    #[expect(clippy::cast_possible_truncation, reason = "a small positive number")]
    let kind = uniform(0.0, OUTLINES.len() as f64) as usize % OUTLINES.len();
    let (_, outline) = OUTLINES[kind];
    let mut image = Vec::with_capacity(rows * cols);
    for row in 0..rows {
        for col in 0..cols {
            let mut covered = 0.0;
            for k in 0..SAMPLES * SAMPLES {
                let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
                let y = row as f64 + offset(k / SAMPLES) - centre[0];
                let x = col as f64 + offset(k % SAMPLES) - centre[1];
                covered += f64::from(u8::from(outline(cos * x + sin * y, cos * y - sin * x, a, b)));
            }
            // a sum of uniform numbers is nearly normal; its standard deviation is one half
            let normal: f64 = (0..3).map(|_| uniform(-0.5, 0.5)).sum::<f64>() * 2.0;
            image.push(covered / (SAMPLES * SAMPLES) as f64 * (gain_log_sd * normal).exp());
        }
    }
    (image, kind)
}

/// The `images` (taxels × images) on taxels whose gains scatter as a skin's do, other ones in every image.
pub(super) fn with_gains(images: &Matrix, streams: Streams) -> Matrix {
    let gain_log_sd = VelostatConfig::default().spread_log_sd;
    let mut scattered = images.clone();
    for taxel in 0..images.nrows() {
        let mut rng = streams.rng("layout/gains", taxel as u64);
        for value in scattered.row_mut(taxel) {
            *value *= (gain_log_sd * normal(|| rng.random())).exp();
        }
    }
    scattered
}

/// A number that is nearly normal, from uniform ones in [0, 1): a sum of twelve of them has the variance 1.
fn normal(mut uniform: impl FnMut() -> f64) -> f64 {
    (0..12).map(|_| uniform() - 0.5).sum()
}

/// Dictionary of blobs at every taxel, taxels × atoms, every atom of length 1.
pub(super) fn blobs(layout: &SkinLayout) -> Matrix {
    let (rows, cols) = (layout.rows(), layout.cols());
    let widths = if layout.taxels() > FEW_TAXELS { &WIDTHS[..1] } else { &WIDTHS };
    let mut atoms: Vec<Vec<f64>> = Vec::new();
    for width in widths {
        for centre in 0..rows * cols {
            let at = |k: usize| {
                let dr = (k / cols) as f64 - (centre / cols) as f64;
                let dc = (k % cols) as f64 - (centre % cols) as f64;
                let r = dr.hypot(dc) / width;
                if r > REACH { 0.0 } else { (-0.5 * r * r).exp() }
            };
            let atom: Vec<f64> = (0..rows * cols).map(at).collect();
            let length = atom.iter().map(|v| v * v).sum::<f64>().sqrt();
            atoms.push(atom.iter().map(|v| v / length).collect());
        }
    }
    Matrix::from_column_slices(rows * cols, &atoms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetries_of_a_sheet() {
        let all = symmetries(2, 3);
        assert_eq!(all, [[0, 1, 2, 3, 4, 5], [3, 4, 5, 0, 1, 2], [2, 1, 0, 5, 4, 3], [5, 4, 3, 2, 1, 0]]);
        // those of a square leave all distances as they are
        let square: std::collections::BTreeSet<_> = symmetries(3, 3).into_iter().collect();
        let distance = |a: usize, b: usize| (a / 3).abs_diff(b / 3) + (a % 3).abs_diff(b % 3);
        assert_eq!(square.len(), 8);
        for taxels in square {
            assert!((0..9).all(|a| (0..9).all(|b| distance(a, b) == distance(taxels[a], taxels[b]))), "{taxels:?}");
        }
    }

    /// Every taxel of the middle is in many shapes, and the seed decides.
    #[test]
    fn shapes_cover_a_skin_of_any_layout() {
        for (rows, cols, pitch_m) in [(10, 10, 0.015), (6, 14, 0.01)] {
            let layout = SkinLayout::new(rows, cols, pitch_m, SkinLayout::usual_electrode_m(pitch_m)).unwrap();
            let (images, families) = shape_images(&layout, 1).unwrap();
            assert_eq!(images.ncols(), families.len());
            assert_eq!(images.nrows(), rows * cols);
            let middle = images.row(rows / 2 * cols + cols / 2);
            let touched = middle.iter().filter(|g| **g > 0.0).count();
            assert!(touched > images.ncols() / 4, "{rows} × {cols}: {touched} of {}", images.ncols());
        }
    }

    /// Every taxel is covered by shapes, and atoms have length 1, on a strip and on a sheet.
    #[test]
    fn any_layout_has_images_and_atoms() {
        for (rows, cols) in [(1, 64), (12, 20), (2, 1)] {
            let layout = SkinLayout::new(rows, cols, 5e-3, 3e-3).unwrap();
            let (images, _) = outline_images(&layout, Streams::new(1));
            assert_eq!((images.nrows(), images.ncols()), (rows * cols, SHAPES));
            for taxel in 0..rows * cols {
                let touched = images.row(taxel).iter().filter(|v| **v > 0.1).count();
                assert!(touched > SHAPES / 100, "{rows} × {cols}: taxel {taxel} is in {touched} shapes");
            }
            let atoms = blobs(&layout);
            for k in 0..atoms.ncols() {
                let length: f64 = atoms.column(k).iter().map(|v| v * v).sum();
                assert!((length - 1.0).abs() < 1e-12, "{length}");
            }
        }
    }
}
