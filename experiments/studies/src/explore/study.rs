//! Searches the number of measurements that a skin of every size needs.

use super::measure::MeasuredWires;
use super::report::{ExploreReport, ExploreTrial, SizeRow};
use super::scene::{ExploreScene, located, scene};
use super::wiring::{Way, Wiring, wirings};
use crate::electronics::ElectronicsStudy;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::Seeding;
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::matrix_free::RegionPursuit;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use std::time::Instant;

/// Wanted IoU.
pub const WANTED_IOU: f64 = 0.8;
/// Wanted share of contacts found within less than a taxel of their true place.
pub const WANTED_LOCATED: f64 = 0.95;
/// Rounds of a recovery.
const MAX_ROUNDS: usize = 10;
/// Measurements a contact at which the search begins: it has four unknowns, place, width and peak.
const FIRST_PER_CONTACT: usize = 8;
/// The search ends at this share of the taxels, or at this many measurements where that is more.
const MOST: (f64, usize) = (0.05, 1000);

/// Settings of `spts explore`, which finds how many measurements large skins need.
#[derive(Debug, Clone, Serialize)]
pub struct ExploreStudy {
    /// Sides of the square skins, taxels.
    pub sides: Vec<u32>,
    /// Number of scenes for each size.
    pub scenes: u64,
    /// Seeds of the cells.
    pub seeding: Seeding,
    /// Whether M is only doubled, without a trial between the last two values.
    pub quick: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl ExploreStudy {
    /// Explores every size with every wiring. All values except times are the same for any number of threads.
    ///
    /// # Errors
    /// [`Refusal`] if the electronics cannot be built, or a wire cannot be measured.
    pub fn run(&self, progress: &dyn Progress) -> Result<ExploreReport, Refusal> {
        let electronics = ElectronicsStudy::as_designed()?;
        progress.stage("exploring", Some(self.sides.len() * Way::ALL.len()));
        let mut rows = Vec::new();
        for &side in &self.sides {
            let scenes: Vec<ExploreScene> = (0..self.scenes)
                .map(|index| {
                    scene(
                        side as usize,
                        electronics.skin.pressed_s,
                        Streams::new(self.seed),
                        index,
                    )
                })
                .collect();
            let Some(first) = scenes.first() else { continue };
            for wiring in wirings(side * side, first, self.seeding, &electronics)? {
                rows.push(self.search(side as usize, &wiring, &scenes, &electronics)?);
                progress.step();
            }
        }
        progress.end();
        Ok(ExploreReport::new(rows, electronics.largest_on_one_wire()?))
    }

    /// Raises M until both aims are reached or the end of the search.
    fn search(
        &self,
        side: usize,
        wiring: &Wiring,
        scenes: &[ExploreScene],
        electronics: &ElectronicsStudy,
    ) -> Result<SizeRow, Refusal> {
        let streams = Streams::new(self.seed);
        let mut measured = Vec::with_capacity(scenes.len());
        for (index, scene) in (0..).zip(scenes) {
            let streams = streams.child("explore/skin", index);
            measured.push(MeasuredWires::new(wiring, scene, electronics.skin.idle_s, streams)?);
        }
        let taxels = side * side;
        let most = most_measurements(taxels).div_ceil(wiring.wires);
        let contacts = scenes.first().map_or(1, |scene| scene.contacts);
        let mut rows = (FIRST_PER_CONTACT * contacts).div_ceil(wiring.wires).max(8).min(most);
        let mut trials: Vec<ExploreTrial> = Vec::new();
        loop {
            trials.push(trial(side, wiring, scenes, &mut measured, rows)?);
            let reached = |aim: fn(&ExploreTrial) -> bool| trials.iter().any(aim);
            if rows == most || (reached(ExploreTrial::has_iou) && reached(ExploreTrial::has_located)) {
                break;
            }
            rows = (2 * rows).min(most);
        }
        if !self.quick {
            refine(&mut trials, |rows| trial(side, wiring, scenes, &mut measured, rows))?;
        }
        Ok(SizeRow::new(wiring, taxels, contacts, trials))
    }
}

/// Half an octave below the least M that reaches an aim.
fn refine(
    trials: &mut Vec<ExploreTrial>,
    mut at: impl FnMut(usize) -> Result<ExploreTrial, Refusal>,
) -> Result<(), Refusal> {
    for aim in [ExploreTrial::has_iou, ExploreTrial::has_located] {
        let least = trials.iter().filter(|t| aim(t)).map(|t| t.rows_per_wire).min();
        let between = least.map(half_octave_below);
        if let Some(rows) = between.filter(|rows| trials.iter().all(|t| t.rows_per_wire != *rows) && *rows >= 4) {
            trials.push(at(rows)?);
            trials.sort_by_key(|t| t.rows_per_wire);
        }
    }
    Ok(())
}

/// `rows`/√2.
#[expect(clippy::cast_possible_truncation, reason = "thousands of rows")]
fn half_octave_below(rows: usize) -> usize {
    (rows as f64 * std::f64::consts::FRAC_1_SQRT_2).round() as usize
}

/// Measurements at which the search ends.
#[expect(clippy::cast_possible_truncation, reason = "skins stay far below 2^52 taxels")]
fn most_measurements(taxels: usize) -> usize {
    let share = (taxels as f64 * MOST.0).round() as usize;
    share.max(MOST.1).min(taxels)
}

/// `rows` measurements a wire of every scene, recovered and scored.
fn trial(
    side: usize,
    wiring: &Wiring,
    scenes: &[ExploreScene],
    measured: &mut [MeasuredWires],
    rows: usize,
) -> Result<ExploreTrial, Refusal> {
    let pursuit = RegionPursuit {
        max_rounds: MAX_ROUNDS,
        ..RegionPursuit::new(side, side)
    };
    let mut sum = ExploreTrial::none(rows, rows * wiring.wires);
    let share = 1.0 / scenes.len() as f64;
    let (mut truth, mut mask) = (Vec::new(), Vec::new());
    for (scene, measured) in scenes.iter().zip(measured) {
        let (phi, volts) = measured.first(rows)?;
        let time = Instant::now();
        let found = pursuit.recover(&phi, &volts, None).map_err(Refusal::from_error)?;
        sum.decode_s += share * time.elapsed().as_secs_f64();
        support(&scene.image_s, SUPPORT_THRESHOLD, &mut truth);
        support(&found.image, SUPPORT_THRESHOLD, &mut mask);
        sum.iou += share * SupportScore::new(&mask, &truth).iou;
        sum.located += share * located(&found.image, &scene.image_s, side);
        let operator: usize = phi.parts().iter().map(|part| part.inner().bytes()).sum();
        sum.bytes = sum.bytes.max(found.bytes + operator + size_of_val(&volts[..]));
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Everything but the times, from one thread and from three.
    #[test]
    fn any_number_of_threads_gives_the_same_numbers() {
        let electronics = ElectronicsStudy::as_designed().unwrap();
        let explore = ExploreStudy {
            sides: vec![20],
            scenes: 2,
            seeding: Seeding::Mixed,
            quick: false,
            seed: 5,
        };
        let rows = |threads: usize| -> Vec<SizeRow> {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let scenes: Vec<ExploreScene> = (0..2).map(|i| scene(20, 150e-6, Streams::new(5), i)).collect();
            let wirings = wirings(400, &scenes[0], Seeding::Mixed, &electronics).unwrap();
            let search = |wiring: &Wiring| explore.search(20, wiring, &scenes, &electronics).unwrap();
            let mut rows: Vec<SizeRow> = pool.install(|| wirings.iter().map(search).collect());
            rows.iter_mut()
                .flat_map(|r| &mut r.trials)
                .for_each(|t| t.decode_s = 0.0);
            rows
        };
        let (one, three) = (rows(1), rows(3));
        assert_eq!(one, three);
        // an ideal wire needs far fewer measurements than there are taxels
        assert!(
            one[0].m_iou.is_some_and(|m| m < 200) && one[0].m_located.is_some(),
            "{:?}",
            one[0]
        );
    }
}
