//! Contacts at random places of a large skin, and their places in an image.

use crate::wiring::Wiring;
use rand::RngExt as _;
use rayon::prelude::*;
use spts_circuit::{Constant, INCREMENT, MULTIPLIER, Mode, Readout};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use spts_recon::operator::{Centred, SignGenerator, SignOperator, SubArrays, centre};

/// Taxels to one contact: 40 contacts on 480 × 480 taxels.
const TAXELS_PER_CONTACT: usize = 5760;
/// Contacts of a small skin.
const FEWEST_CONTACTS: usize = 2;
/// Radius of a contact, taxels; at most a quarter of the skin's side.
const RADIUS_TAXELS: std::ops::Range<f64> = 1.0..4.0;
/// Conductance in the middle of a contact over that of a pressed taxel.
const PEAK: std::ops::Range<f64> = 0.5..1.0;

/// A pressed skin.
#[derive(Debug, Clone)]
pub(super) struct ExploreScene {
    /// Conductance minus that of the idle skin, S, row-major, `side` × `side`.
    pub(super) image_s: Vec<f64>,
    /// Contacts.
    pub(super) contacts: usize,
}

/// Half-ellipsoids of conductance, G = peak·√(1 − d²/R²), with radius, peak and place uniform at random; where two
/// overlap the larger conductance counts. `pressed_s` is the largest peak there can be, S.
pub(super) fn scene(side: usize, pressed_s: f64, streams: Streams, index: u64) -> ExploreScene {
    let mut rng = streams.rng("explore/scene", index);
    let mut image_s = vec![0.0_f64; side * side];
    let contacts = (side * side / TAXELS_PER_CONTACT).max(FEWEST_CONTACTS);
    let most = RADIUS_TAXELS.end.min(0.25 * side as f64).max(1.5);
    for _ in 0..contacts {
        let middle: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..=(side - 1) as f64));
        let radius = rng.random_range(RADIUS_TAXELS.start..most);
        let peak_s = pressed_s * rng.random_range(PEAK);
        for (k, v) in image_s.iter_mut().enumerate() {
            let square = ((k / side) as f64 - middle[0]).powi(2) + ((k % side) as f64 - middle[1]).powi(2);
            *v = v.max(peak_s * (1.0 - square / (radius * radius)).max(0.0).sqrt());
        }
    }
    ExploreScene { image_s, contacts }
}

/// Centres of mass, (row, column), of the connected patches of an image above the threshold of the support; neighbours
/// touch at a side or a corner.
pub(super) fn patches(image: &[f64], side: usize) -> Vec<(f64, f64)> {
    let mut open = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut open);
    let (mut centres, mut stack) = (Vec::new(), Vec::new());
    for first in 0..image.len() {
        if !open[first] {
            continue;
        }
        open[first] = false;
        stack.push(first);
        let (mut sum, mut row, mut col) = (0.0, 0.0, 0.0);
        while let Some(k) = stack.pop() {
            let (r, c) = (k / side, k % side);
            sum += image[k];
            row += image[k] * r as f64;
            col += image[k] * c as f64;
            for r in r.saturating_sub(1)..=(r + 1).min(side - 1) {
                for c in c.saturating_sub(1)..=(c + 1).min(side - 1) {
                    if std::mem::take(&mut open[r * side + c]) {
                        stack.push(r * side + c);
                    }
                }
            }
        }
        centres.push((row / sum, col / sum));
    }
    centres
}

/// Share of the patches of `truth` with one of `found` less than a taxel away; 1 without patches.
pub(super) fn located(found: &[f64], truth: &[f64], side: usize) -> f64 {
    let (found, truth) = (patches(found, side), patches(truth, side));
    let near = |t: &&(f64, f64)| found.iter().any(|f| (f.0 - t.0).hypot(f.1 - t.1) < 1.0);
    if truth.is_empty() {
        return 1.0;
    }
    truth.iter().filter(near).count() as f64 / truth.len() as f64
}

/// The bit of a binary cell's generator that is its sign: the top byte is 128 or more where it is set.
const SIGN_BIT: u32 = 31;

/// Operator of all wires.
pub(super) type Wired = SubArrays<Centred<SignOperator>>;

/// One wire, pressed and idle, from its first measurement on.
struct Wire {
    pressed: (Readout, Constant),
    idle: (Readout, Constant),
    seeds: Vec<u32>,
    /// Pressed minus idle, V.
    volts: Vec<f64>,
}

/// A skin under one scene, measured as far as was asked for.
pub(super) struct MeasuredWires {
    wires: Vec<Wire>,
    generator: SignGenerator,
}

impl MeasuredWires {
    /// The skin `wiring` under `scene`; no measurement yet. The idle skin was recorded from the same rows on in a
    /// session before: it holds what the cells and the idle conductance add.
    pub(super) fn new(wiring: &Wiring, scene: &ExploreScene, idle_s: f64, streams: Streams) -> Result<Self, Refusal> {
        let (taxels, skin) = (scene.image_s.len(), SkinLayout::default());
        let mut wires = Vec::with_capacity(wiring.wires);
        for w in 0..wiring.wires {
            let band = w * taxels / wiring.wires..(w + 1) * taxels / wiring.wires;
            // one wire's taxels, whatever their places
            let layout = SkinLayout::new(1, band.len(), skin.pitch_m(), skin.electrode_m())?;
            let device = streams.child("explore/wire", w as u64);
            let line = |session: u64, conductance_s: Vec<f64>| -> Result<(Readout, Constant), Refusal> {
                let readout = Readout::new(&wiring.profile, Mode::Compressive, &layout, device, session);
                let map = ConductanceMap::from_values(1, conductance_s.len(), conductance_s);
                Ok((readout?, Constant::new(map)?))
            };
            let conductance_s = scene.image_s[band.clone()].iter().map(|g| g + idle_s).collect();
            let pressed = line(1, conductance_s)?;
            let weights = pressed.0.weights().clone();
            wires.push(Wire {
                idle: line(0, vec![idle_s; band.len()])?,
                pressed,
                seeds: (0..band.len()).filter_map(|k| weights.seed(k)).collect(),
                volts: Vec::new(),
            });
        }
        let generator = SignGenerator::new(MULTIPLIER, INCREMENT, SIGN_BIT)?;
        Ok(Self { wires, generator })
    }

    /// The first `rows` measurements of every wire, V, wire after wire, and their operator; the mean of every wire is
    /// taken off, which holds what the drives' asymmetry makes of all that is pressed.
    pub(super) fn first(&mut self, rows: usize) -> Result<(Wired, Vec<f64>), Refusal> {
        self.wires.par_iter_mut().try_for_each(|wire| wire.extend(rows))?;
        let operator = |wire: &Wire| Centred::new(SignOperator::new(self.generator, wire.seeds.clone(), 0, rows));
        let phi = SubArrays::new(self.wires.iter().map(operator).collect());
        let mut volts: Vec<f64> = self.wires.iter().flat_map(|w| w.volts[..rows].iter().copied()).collect();
        volts.chunks_exact_mut(rows.max(1)).for_each(centre);
        Ok((phi, volts))
    }
}

impl Wire {
    /// Measures on until there are `rows` measurements.
    fn extend(&mut self, rows: usize) -> Result<(), Refusal> {
        let more = rows.saturating_sub(self.volts.len());
        if more == 0 {
            return Ok(());
        }
        let run = |(readout, source): &mut (Readout, Constant)| readout.measure(source, more);
        let (pressed, idle) = rayon::join(|| run(&mut self.pressed), || run(&mut self.idle));
        let (pressed, idle) = (pressed?, idle?);
        self.volts.extend(pressed.iter().zip(&idle).map(|(p, i)| p - i));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::electronics::ElectronicsStudy;
    use crate::wiring::{Way, wirings};
    use spts_circuit::{Seeding, WeightMode, Weights};
    use spts_recon::LinearOperator as _;

    #[test]
    fn patches_are_counted_by_hand() {
        let mut image = vec![0.0; 25];
        for (k, v) in [(0, 1.0), (6, 1.0), (19, 3.0), (24, 1.0), (12, 0.1)] {
            image[k] = v;
        }
        let found = patches(&image, 5);
        // (0, 0) and (1, 1) touch at a corner; (3, 4) weighs three times as much as (4, 4); 0.1 is below .23 · 3
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - 0.5).abs() + (found[0].1 - 0.5).abs() < 1e-15);
        assert!((found[1].0 - 3.25).abs() + (found[1].1 - 4.0).abs() < 1e-15);
        assert!((located(&image, &image, 5) - 1.0).abs() < 1e-15);
        assert!(located(&[0.0; 25], &image, 5).abs() < 1e-15);
    }

    #[test]
    fn scenes_follow_from_their_seed() {
        let (a, b) = (scene(96, 1e-4, Streams::new(3), 0), scene(96, 1e-4, Streams::new(3), 1));
        assert_eq!(a.contacts, 2);
        assert!(a.image_s == scene(96, 1e-4, Streams::new(3), 0).image_s && a.image_s != b.image_s);
        assert!(a.image_s.iter().all(|v| (0.0..=1e-4).contains(v)));
    }

    /// Any row of the circuit's weights, however far from the seeds, is a row of the recovery's operator.
    #[test]
    fn far_rows_are_the_circuits() {
        for (seeding, first_row) in
            [(Seeding::Address, 0), (Seeding::Mixed, 1_000_003), (Seeding::Mixed, (1 << 40) + 5)]
        {
            let weights = Weights::new(WeightMode::Binary, seeding, 77);
            let generator = SignGenerator::new(MULTIPLIER, INCREMENT, SIGN_BIT).unwrap();
            let phi = SignOperator::new(generator, (0..77).map(|k| seeding.seed(k)).collect(), first_row, 9);
            let mut rows = vec![0.0; 9 * 77];
            weights.fill_rows(first_row, &mut rows);
            for (r, row) in rows.chunks(77).enumerate() {
                let (mut unit, mut found) = (vec![0.0; 9], vec![0.0; 77]);
                unit[r] = 1.0;
                phi.apply_adjoint(&unit, &mut found);
                assert_eq!(found, row, "row {first_row} + {r}");
            }
        }
    }

    /// The recovery's operator has the rows of the circuit's weights: ideal wires deliver Φx to rounding.
    #[test]
    fn ideal_wires_deliver_the_operator_times_the_image() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let scene = scene(40, 150e-6, Streams::new(1), 0);
        for seeding in [Seeding::Address, Seeding::Mixed] {
            let mut wiring = wirings(&scene.image_s, seeding, &electronics).unwrap().swap_remove(0);
            assert_eq!(wiring.way, Way::Ideal);
            for wires in [1, 3] {
                wiring.wires = wires;
                let mut measured = MeasuredWires::new(&wiring, &scene, 1e-6, Streams::new(1)).unwrap();
                measured.first(10).unwrap();
                let (phi, volts) = measured.first(37).unwrap();
                let mut expected = vec![0.0; 37 * wires];
                phi.apply(&scene.image_s, &mut expected);
                for (v, e) in volts.iter().zip(&expected) {
                    let e = e * wiring.profile.volts_per_siemens();
                    // differences of sums of 1600 terms of up to 0.7 V, rounded
                    assert!((v - e).abs() < 1e-10, "{v} V against {e} V");
                }
            }
        }
    }
}
