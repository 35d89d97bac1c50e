//! Taxels at any places, arranged on a grid for decoders that take neighbours from rows and columns.

use crate::algorithm::{Algorithm, Answer, Belief, Confidence, DecodeError, Subject, Trained};
use crate::windows::Window;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use spts_input::Refusal;
use spts_recon::MatrixView;
use std::sync::Arc;

/// A cell of a grid for every taxel of a skin of any shape. Taxels that are near each other on the skin have cells near
/// each other, and a few cells are empty.
///
/// The taxels are halved across their longest axis again and again, and the grid with them; axes are those of the
/// smallest rectangle round the skin, and the third. Then two cells are exchanged wherever it lowers Σ w d, d the
/// distance on the grid, in cells, between a taxel and one of its eight nearest, and w the pitch over their distance
/// on the skin, which counts three times where the normals are more than 90° apart. It ends when nothing is gained.
/// This is the quadratic assignment problem by exchanges of two (R. E. Burkard, "Quadratic assignment problems",
/// EJOR 15, 1984).
///
/// ```
/// use spts_eval::placed::Arrangement;
///
/// // six taxels in a ring
/// let ring: Vec<[f64; 3]> = (0..6).map(|k| f64::from(k) * 1.047).map(|a| [a.cos(), a.sin(), 0.0]).collect();
/// let found = Arrangement::new(&ring, &[[0.0, 0.0, 1.0]; 6])?;
/// let [rows, cols] = found.shape();
/// assert!(rows * cols >= 6 && found.cells().iter().all(|cell| *cell < rows * cols));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrangement {
    shape: [usize; 2],
    cells: Arc<[usize]>,
}

/// Neighbours of a taxel that are kept near it.
const NEAREST: usize = 8;
/// By what the distance of taxels that look away from each other is multiplied.
const TURNED: f64 = 3.0;
/// Turns by half a degree that are tried, and what that is in radians.
const TURNS: u32 = 180;
const TURN: f64 = std::f64::consts::PI / 360.0;
/// By what the spread along its own axis counts more when rows or columns are halved.
const OWN: f64 = 3.0;
/// Largest coordinate, m, as of the sample points of a skin.
const MOST_M: f64 = 1e3;
/// Most rounds of exchanges; those of 2,048 taxels end after some twenty.
const ROUNDS: usize = 50;

impl Arrangement {
    /// Most taxels: the distances of all pairs are computed.
    pub const MOST_TAXELS: usize = 1 << 14;

    /// Arranges taxels at `places`, m, whose outward unit normals are `normals`.
    ///
    /// # Errors
    /// [`Refusal`] without a taxel or with too many, for different numbers of places and normals, and for a coordinate
    /// outside [−1000, 1000].
    pub fn new(places: &[[f64; 3]], normals: &[[f64; 3]]) -> Result<Self, Refusal> {
        let (taxels, found) = (places.len(), normals.len());
        if taxels == 0 || taxels != found {
            return Err(Refusal::new(format!("{taxels} places and {found} normals: one of each a taxel is needed")));
        }
        if taxels > Self::MOST_TAXELS {
            return Err(Refusal::range("taxels", taxels as f64, "[1, 16384]"));
        }
        for (what, numbers) in [("places", places), ("normals", normals)] {
            let within = |v: &f64| (-MOST_M..=MOST_M).contains(v);
            if let Some(k) = numbers.iter().position(|v| !v.iter().all(within)) {
                return Err(Refusal::new(format!("`{what}[{k}]` = {:?} is outside [-1000, 1000]", numbers[k])));
            }
        }
        let places: Vec<Vector3<f64>> = places.iter().map(|v| Vector3::from(*v)).collect();
        let normals: Vec<Vector3<f64>> = normals.iter().map(|v| Vector3::from(*v)).collect();
        let near = Near::new(&places, &normals);
        let along = along_axes(&places);
        let shape = shape(&along, near.pitch);
        let mut cells = vec![0; taxels];
        let spread = |axis: usize| along.iter().map(|place| place[axis].powi(2)).sum::<f64>();
        let lengthwise = if spread(0) >= spread(1) { [0, 1] } else { [1, 0] };
        let all = [0, shape[0], 0, shape[1]];
        halve(&along, lengthwise, &mut (0..taxels).collect::<Vec<_>>(), all, shape[1], &mut cells);
        near.exchange(shape, &mut cells);
        // of both ways round the one that leaves taxels in order as they are
        if cells[0] > cells[taxels - 1] {
            cells.iter_mut().for_each(|cell| *cell = shape[0] * shape[1] - 1 - *cell);
        }
        Ok(Self { shape, cells: cells.into() })
    }

    /// Rows and columns of the grid.
    pub fn shape(&self) -> [usize; 2] {
        self.shape
    }

    /// The cell of every taxel, row by row from 0; no two are the same.
    pub fn cells(&self) -> &[usize] {
        &self.cells
    }

    /// `decoder`, which has been trained for the grid, as one for the taxels in their own order.
    pub fn place(self, decoder: Arc<dyn Trained>) -> Arc<dyn Trained> {
        Arc::new(Placed { decoder, at: self })
    }
}

/// Places along three axes, of which the first two have the smallest rectangle round them: rows and columns of a grid
/// are then along them, however it is turned.
fn along_axes(places: &[Vector3<f64>]) -> Vec<[f64; 3]> {
    let mean = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let spread: Matrix3<f64> = places.iter().map(|place| (place - mean) * (place - mean).transpose()).sum();
    let parts = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| parts.eigenvalues[*b].total_cmp(&parts.eigenvalues[*a]));
    let along = |place: &Vector3<f64>| order.map(|k| (place - mean).dot(&parts.eigenvectors.column(k)));
    let places: Vec<[f64; 3]> = places.iter().map(along).collect();
    let turned = |step: u32| {
        let (sin, cos) = (libm::sin(f64::from(step) * TURN), libm::cos(f64::from(step) * TURN));
        move |&[x, y, z]: &[f64; 3]| [cos * x + sin * y, cos * y - sin * x, z]
    };
    let area = |step: u32| {
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let ends = places.iter().map(turned(step)).fold([ends; 2], |ends, place| {
            [0, 1].map(|axis| [ends[axis][0].min(place[axis]), ends[axis][1].max(place[axis])])
        });
        ends.iter().map(|[least, most]| most - least).product::<f64>()
    };
    // of turns that are as good, the first
    let areas = (0..TURNS).map(|step| (area(step), step));
    let (_, best) = areas.fold((f64::INFINITY, 0), |best, this| if this.0 < best.0 { this } else { best });
    places.iter().map(turned(best)).collect()
}

/// Rows and columns: as many columns as taxels fit along the longest axis, at least as many as rows.
fn shape(places: &[[f64; 3]], pitch: f64) -> [usize; 2] {
    let taxels = places.len();
    // c taxels in a row have a variance of (c² − 1)/12 pitches²
    let variance = |axis: usize| places.iter().map(|place| (place[axis] / pitch).powi(2)).sum::<f64>() / taxels as f64;
    let longest = (12.0 * variance(0).max(variance(1)) + 1.0).sqrt().round();
    let square = (1..).find(|side| side * side >= taxels).unwrap_or(taxels);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the number of taxels")]
    let cols = (longest.min(taxels as f64) as usize).clamp(square, taxels);
    let rows = taxels.div_ceil(cols);
    [rows, taxels.div_ceil(rows)]
}

/// Gives the cells of rows and columns `[r0, r1, c0, c1]` of a grid with `cols` columns to `taxels`, of which there are
/// no more. `lengthwise` are the axes of the columns and of the rows.
fn halve(
    places: &[[f64; 3]],
    lengthwise: [usize; 2],
    taxels: &mut [usize],
    of: [usize; 4],
    cols: usize,
    cells: &mut [usize],
) {
    let [r0, r1, c0, c1] = of;
    let (height, width) = (r1 - r0, c1 - c0);
    if taxels.len() <= 1 {
        taxels.iter().for_each(|taxel| cells[*taxel] = (r0 + r1) / 2 * cols + (c0 + c1) / 2);
        return;
    }
    let by_rows = height >= width;
    let spread = |axis: usize| {
        let mean = taxels.iter().map(|k| places[*k][axis]).sum::<f64>() / taxels.len() as f64;
        let of_axis: f64 = taxels.iter().map(|k| (places[*k][axis] - mean).powi(2)).sum();
        if axis == lengthwise[usize::from(by_rows)] { OWN * of_axis } else { of_axis }
    };
    let spreads = [0, 1, 2].map(spread);
    let axis = (1..3).fold(0, |best, axis| if spreads[axis] > spreads[best] { axis } else { best });
    taxels.sort_by(|a, b| places[*a][axis].total_cmp(&places[*b][axis]).then(a.cmp(b)));
    let (sides, [first, second]) = if by_rows {
        let middle = r0 + height / 2;
        ([(middle - r0) * width, (r1 - middle) * width], [[r0, middle, c0, c1], [middle, r1, c0, c1]])
    } else {
        let middle = c0 + width / 2;
        ([height * (middle - c0), height * (c1 - middle)], [[r0, r1, c0, middle], [r0, r1, middle, c1]])
    };
    let share = (taxels.len() * sides[0]).div_ceil(height * width);
    let (before, after) = taxels.split_at_mut(share.clamp(taxels.len().saturating_sub(sides[1]), sides[0]));
    halve(places, lengthwise, before, first, cols, cells);
    halve(places, lengthwise, after, second, cols, cells);
}

/// Which taxels are near which, and by how much.
struct Near {
    /// Median distance of a taxel from its nearest.
    pitch: f64,
    /// Of every taxel the others that belong near it, and their weights.
    of: Vec<Vec<(usize, f64)>>,
}

impl Near {
    fn new(places: &[Vector3<f64>], normals: &[Vector3<f64>]) -> Self {
        let taxels = places.len();
        let mut of = vec![Vec::new(); taxels];
        let nearest = |k: usize| {
            let away = |other: usize| {
                let turned = if normals[k].dot(&normals[other]) < 0.0 { TURNED } else { 1.0 };
                (turned * (places[k] - places[other]).norm(), other)
            };
            let mut others: Vec<(f64, usize)> = (0..taxels).filter(|other| *other != k).map(away).collect();
            let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            if others.len() > NEAREST {
                others.select_nth_unstable_by(NEAREST, order);
                others.truncate(NEAREST);
            }
            others.sort_by(order);
            others
        };
        let found: Vec<_> = (0..taxels).into_par_iter().map(nearest).collect();
        let mut first: Vec<f64> = found.iter().filter_map(|others| Some(others.first()?.0)).collect();
        first.sort_by(f64::total_cmp);
        let pitch = first.get(first.len() / 2).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
        let weight = |away: f64| pitch / away.max(0.1 * pitch);
        for (k, others) in found.iter().enumerate() {
            for &(away, other) in others {
                // both ways, once each
                if other > k || !found[other].iter().any(|(_, back)| *back == k) {
                    of[k].push((other, weight(away)));
                    of[other].push((k, weight(away)));
                }
            }
        }
        Self { pitch, of }
    }

    /// Exchanges cells of the grid until no exchange brings neighbours nearer to each other.
    fn exchange(&self, [rows, cols]: [usize; 2], cells: &mut [usize]) {
        let place = |cell: usize| [(cell / cols) as f64, (cell % cols) as f64];
        let mut at: Vec<[f64; 2]> = cells.iter().map(|cell| place(*cell)).collect();
        let mut taken = vec![None; rows * cols];
        cells.iter().enumerate().for_each(|(k, cell)| taken[*cell] = Some(k));
        // what the neighbours of a taxel, but for `not`, cost it at a place
        let cost = |at: &[[f64; 2]], taxel: Option<usize>, place: [f64; 2], not: Option<usize>| -> f64 {
            let near = taxel.into_iter().flat_map(|k| &self.of[k]).filter(|(other, _)| Some(*other) != not);
            let away = |of: [f64; 2]| ((of[0] - place[0]).powi(2) + (of[1] - place[1]).powi(2)).sqrt();
            near.map(|(other, weight)| weight * away(at[*other])).sum()
        };
        for _ in 0..ROUNDS {
            let mut exchanged = false;
            for k in 0..cells.len() {
                let total: f64 = self.of[k].iter().map(|(_, weight)| weight).sum();
                if total == 0.0 {
                    continue;
                }
                let middle = [0, 1].map(|axis| self.of[k].iter().map(|(o, w)| w * at[*o][axis]).sum::<f64>() / total);
                let here = at[k];
                let mut best = (-1e-9, None);
                for around in [middle, here] {
                    for near in 0..9 {
                        let row = around[0].round() + f64::from(near / 3) - 1.0;
                        let col = around[1].round() + f64::from(near % 3) - 1.0;
                        if !(0.0..rows as f64).contains(&row) || !(0.0..cols as f64).contains(&col) {
                            continue;
                        }
                        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the grid")]
                        let cell = row as usize * cols + col as usize;
                        let other: Option<usize> = taken[cell];
                        let there = place(cell);
                        let gain = cost(&at, Some(k), there, other) + cost(&at, other, here, Some(k))
                            - cost(&at, Some(k), here, other)
                            - cost(&at, other, there, Some(k));
                        if other != Some(k) && gain < best.0 {
                            best = (gain, Some((cell, other)));
                        }
                    }
                }
                if let (_, Some((cell, other))) = best {
                    taken[cells[k]] = other;
                    if let Some(other) = other {
                        (cells[other], at[other]) = (cells[k], here);
                    }
                    taken[cell] = Some(k);
                    (cells[k], at[k]) = (cell, place(cell));
                    exchanged = true;
                }
            }
            if !exchanged {
                break;
            }
        }
    }
}

/// A decoder of the grid for taxels in their own order.
struct Placed {
    decoder: Arc<dyn Trained>,
    at: Arrangement,
}

impl Trained for Placed {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(AtWork { decoder: self.decoder.start(), rows: Rows::new(&self.at), image: Vec::new() })
    }

    fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
        let (subject, decoder) = self.decoder.confidence()?;
        Some((subject, Box::new(Sure { decoder, rows: Rows::new(&self.at) })))
    }
}

/// Rows of weights on the grid: empty cells have none.
struct Rows<'a> {
    at: &'a Arrangement,
    own: Vec<f64>,
    placed: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(at: &'a Arrangement) -> Self {
        Self { at, own: Vec::new(), placed: Vec::new() }
    }

    /// The same window with its rows on the grid.
    fn on_grid<'b>(&'b mut self, window: &'b Window<'_>) -> Result<Window<'b>, Refusal> {
        let window = window.with_rows(&mut self.own);
        let (taxels, cells) = (self.at.cells.len(), self.at.shape[0] * self.at.shape[1]);
        self.placed.clear();
        self.placed.resize(window.y.len() * cells, 0.0);
        for (from, to) in window.phi.values().chunks_exact(taxels).zip(self.placed.chunks_exact_mut(cells)) {
            from.iter().zip(&*self.at.cells).for_each(|(weight, cell)| to[*cell] = *weight);
        }
        let phi = MatrixView::new(window.y.len(), cells, &self.placed)?;
        Ok(Window { phi, signs: None, bits: None, ..window })
    }
}

struct AtWork<'a> {
    decoder: Box<dyn Algorithm + 'a>,
    rows: Rows<'a>,
    image: Vec<f64>,
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        let cells = Arc::clone(&self.rows.at.cells);
        self.decoder.decode(&self.rows.on_grid(window)?, answer)?;
        if !answer.image.is_empty() {
            std::mem::swap(&mut self.image, &mut answer.image);
            answer.image.clear();
            answer.image.extend(cells.iter().map(|cell| self.image[*cell]));
        }
        Ok(())
    }

    fn batched(&self) -> bool {
        self.decoder.batched()
    }
}

struct Sure<'a> {
    decoder: Box<dyn Confidence + 'a>,
    rows: Rows<'a>,
}

impl Confidence for Sure<'_> {
    fn begin(&mut self) {
        self.decoder.begin();
    }

    fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
        self.decoder.observe(&self.rows.on_grid(sample)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decoders::find;
    use crate::training::TrainingData;
    use crate::windows::{Press, PressRows};
    use rand::seq::SliceRandom as _;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;
    use spts_models::{SkinLayout, Streams};
    use spts_recon::Matrix;

    const UP: [f64; 3] = [0.0, 0.0, 1.0];

    /// Places of a grid with 15 mm pitch, turned, in an order drawn from `seed`; and the row and column of each.
    fn shuffled(rows: usize, cols: usize, seed: u64) -> (Vec<[f64; 3]>, Vec<[usize; 2]>) {
        let mut on_grid: Vec<[usize; 2]> = (0..rows * cols).map(|k| [k / cols, k % cols]).collect();
        on_grid.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        let (sin, cos) = (libm::sin(0.7), libm::cos(0.7));
        let place = |&[row, col]: &[usize; 2]| {
            let (x, y) = (0.015 * col as f64, 0.015 * row as f64);
            [cos * x - sin * y, sin * x + cos * y, 0.3]
        };
        (on_grid.iter().map(place).collect(), on_grid)
    }

    /// Share of the pairs of neighbours in `on_grid` whose cells are neighbours, too, corners included.
    fn kept(found: &Arrangement, on_grid: &[[usize; 2]]) -> f64 {
        let away = |[a, b]: [usize; 2], [c, d]: [usize; 2]| a.abs_diff(c).max(b.abs_diff(d));
        let cell = |k: usize| [found.cells[k] / found.shape[1], found.cells[k] % found.shape[1]];
        let pairs = (0..on_grid.len()).flat_map(|k| (0..k).map(move |other| (k, other)));
        let near: Vec<_> = pairs.filter(|(a, b)| away(on_grid[*a], on_grid[*b]) == 1).collect();
        near.iter().filter(|(a, b)| away(cell(*a), cell(*b)) == 1).count() as f64 / near.len() as f64
    }

    /// A grid whose taxels are numbered at random comes back as a grid; a line as that line.
    #[test]
    fn neighbours_stay_neighbours() {
        for (rows, cols) in [(10, 12), (6, 24), (16, 16), (3, 50)] {
            for seed in 0..4 {
                let (places, on_grid) = shuffled(rows, cols, seed);
                let found = Arrangement::new(&places, &vec![UP; places.len()]).unwrap();
                let kept = kept(&found, &on_grid);
                eprintln!("{rows} x {cols}, {seed}: {:?}, {kept:.3} kept", found.shape);
                assert!(kept >= 1.0, "{rows} x {cols}: {kept}");
                let mut cells = found.cells.to_vec();
                cells.sort_unstable();
                cells.dedup();
                assert!(cells.len() == rows * cols && cells[cells.len() - 1] < found.shape[0] * found.shape[1]);
            }
        }
        let (places, on_grid) = shuffled(1, 64, 1);
        let found = Arrangement::new(&places, &[UP; 64]).unwrap();
        let turned = found.cells[0] != on_grid[0][1];
        let expected = on_grid.iter().map(|[_, col]| if turned { 63 - col } else { *col });
        assert_eq!((found.shape, found.cells.to_vec()), ([1, 64], expected.collect()));
    }

    #[test]
    fn any_places_are_arranged_or_refused() {
        for taxels in [1, 2, 3, 7, 50] {
            // all at one place
            let found = Arrangement::new(&vec![[0.1; 3]; taxels], &vec![UP; taxels]).unwrap();
            let mut cells = found.cells.to_vec();
            cells.sort_unstable();
            cells.dedup();
            assert_eq!(cells.len(), taxels);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let places: Vec<[f64; 3]> = (0..300).map(|_| std::array::from_fn(|_| rng.random_range(-1e3..1e3))).collect();
        assert_eq!(Arrangement::new(&places, &vec![UP; 300]), Arrangement::new(&places, &vec![UP; 300]));
        let refused = [
            Arrangement::new(&[], &[]),
            Arrangement::new(&[UP], &[UP, UP]),
            Arrangement::new(&[[f64::NAN, 0.0, 0.0]], &[UP]),
            Arrangement::new(&[[0.0, 1e200, 0.0], UP], &[UP, UP]),
            Arrangement::new(&vec![UP; 1 + (1 << 14)], &vec![UP; 1 + (1 << 14)]),
        ];
        for refused in refused {
            eprintln!("{}", refused.unwrap_err());
        }
    }

    /// On a line, which is a grid of one row, the arranged decoder is the decoder of that row; for shuffled taxels of a
    /// sheet it sees a touch about as well as in order, and the decoder of their row does not.
    #[test]
    fn decoders_are_placed() {
        let decoder = |shape: [usize; 2]| -> Arc<dyn Trained> {
            let layout = SkinLayout::with_pitch(shape[0], shape[1], 0.015).unwrap();
            let data = TrainingData::for_layout(&layout, Streams::new(0)).unwrap();
            (find("amortised").unwrap().train)(&data).unwrap().into()
        };
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut window = |taxels: usize, m: usize, image: &[f64]| {
            let phi: Vec<f64> = (0..m * taxels).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
            let y = phi.chunks_exact(taxels).map(|row| row.iter().zip(image).map(|(w, x)| w * x).sum());
            let y: Vec<f64> = y.collect();
            Press::on(Arc::new(PressRows::of_matrix(&Matrix::from_rows(m, taxels, phi).unwrap())), y, 0.0)
        };
        let image = |decoder: &Arc<dyn Trained>, press: &Press| {
            let mut answer = Answer::default();
            decoder.start().decode(&press.window(0, press.len()).unwrap(), &mut answer).unwrap();
            answer.image
        };
        let line: Vec<[f64; 3]> = (0..40).map(|k| [0.01 * f64::from(k), 0.0, 0.0]).collect();
        let touch: Vec<f64> = (0..40).map(|k| f64::from(u8::from((10..14).contains(&k)))).collect();
        let press = window(40, 20, &touch);
        let placed = Arrangement::new(&line, &[UP; 40]).unwrap().place(decoder([1, 40]));
        assert_eq!(image(&placed, &press), image(&decoder([1, 40]), &press));

        let (places, on_grid) = shuffled(12, 14, 5);
        let touch = |[row, col]: &[usize; 2]| f64::from(u8::from((3..8).contains(row) && (5..9).contains(col)));
        let touch: Vec<f64> = on_grid.iter().map(touch).collect();
        let press = window(168, 24, &touch);
        let arranged = Arrangement::new(&places, &[UP; 168]).unwrap();
        let placed = decoder(arranged.shape());
        let (placed, row) = (arranged.place(placed), decoder([1, 168]));
        let iou = |image: &[f64]| {
            let most = image.iter().copied().fold(0.0, f64::max);
            let both = image.iter().zip(&touch).map(|(x, t)| (*x > 0.23 * most, *t > 0.0));
            let count = |of: fn(bool, bool) -> bool| both.clone().filter(|(a, b)| of(*a, *b)).count() as f64;
            count(|a, b| a && b) / count(|a, b| a || b)
        };
        let [placed, row] = [placed, row].map(|decoder| iou(&image(&decoder, &press)));
        eprintln!("IoU {placed:.2} arranged, {row:.2} in a row");
        assert!(placed > 0.9 && row < 0.5, "{placed}, {row}");
    }
}
