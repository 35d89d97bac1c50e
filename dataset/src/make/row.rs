//! One row of a data set.

use super::Prepared;
use super::press::{Press, State};
use super::skin::Skin;
use super::split::split;
use super::touch::Touch;
use crate::spec::{Choice, Spec};
use spts_models::{ConductanceMap, PressureMap};
use std::sync::Arc;

/// One row of a data set: a window of samples with its truth.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub(super) index: u64,
    pub(super) window: usize,
    pub(super) spec: &'a Spec,
    pub(super) press: &'a Press,
    /// Shapes of the press, at least one.
    pub(super) shapes: &'a [Prepared],
    pub(super) skin: &'a Skin,
}

/// One object of a row.
#[derive(Clone, Copy)]
pub(crate) struct Object<'a> {
    pub(crate) choice: &'a Choice,
    /// Number of the shape.
    pub(crate) number: u64,
    pub(crate) touch: &'a Touch,
    /// Height of its origin above the skin's free surface, m.
    pub(crate) height_m: f64,
}

impl<'a> Row<'a> {
    /// Number of the row.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Number of the press. A row is one window of a press.
    #[must_use]
    pub fn press(&self) -> u64 {
        self.press.number
    }

    /// `train`, `validation` or `test`.
    #[must_use]
    pub fn split(&self) -> &'static str {
        split(self.spec, self.press.number, self.shapes[0].number)
    }

    /// Name of the first object that is pressed; of a procedural shape, the name of its family.
    #[must_use]
    pub fn name(&self) -> Arc<str> {
        Arc::clone(&self.shapes[0].choice.name)
    }

    /// Mean pressure over every taxel's area, Pa.
    #[must_use]
    pub fn pressure(&self) -> &'a PressureMap {
        &self.state().pressure
    }

    /// Conductance of every taxel, S.
    #[must_use]
    pub fn conductance(&self) -> &'a ConductanceMap {
        &self.state().conductance
    }

    /// The raster scan, V; empty if none is recorded.
    #[must_use]
    pub fn image(&self) -> &'a [f64] {
        &self.state().image
    }

    /// The samples of the window, V.
    #[must_use]
    pub fn volts(&self) -> &'a [f64] {
        let m = self.spec.config().record.measurements;
        &self.press.volts[self.window * m..][..m]
    }

    /// Row of Φ at the first measurement of the window, counted from loading the seeds.
    #[must_use]
    pub fn first_row(&self) -> u64 {
        self.press.first_row + self.spec.timing().row_of(self.window as u64)
    }

    /// Φ of the window: measurements × taxels, row-major.
    #[must_use]
    pub fn phi(&self) -> Vec<f64> {
        let m = self.spec.config().record.measurements;
        let mut phi = vec![0.0; m * self.spec.skin().taxels()];
        self.skin.compressive.weights().fill_rows(self.first_row(), &mut phi);
        phi
    }

    /// Time from the touch to the first measurement of the window, s; negative before the touch.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        let timing = self.spec.timing();
        self.press.start_s + timing.row_of(self.window as u64) as f64 / timing.rate_hz
    }

    /// Normal force on the skin, N: the sum of pressure × area.
    #[must_use]
    pub fn contact_force_n(&self) -> f64 {
        self.pressure().sum() * self.spec.skin().cell_area_m2()
    }

    /// Number of saturated samples in the window and in the raster scan.
    #[must_use]
    pub fn saturated(&self) -> [usize; 2] {
        let [wire_v, raster_v] = self.skin.rails_v;
        [
            self.skin.compressive.info().saturated(self.volts(), wire_v),
            self.skin.raster.info().saturated(self.image(), raster_v),
        ]
    }

    fn state(&self) -> &'a State {
        self.press.state(self.window)
    }

    pub(crate) fn spec(&self) -> &'a Spec {
        self.spec
    }

    pub(crate) fn window(&self) -> usize {
        self.window
    }

    /// Object number `slot`, if there are so many.
    pub(crate) fn object(&self, slot: usize) -> Option<Object<'a>> {
        let prepared = self.shapes.get(slot)?;
        Some(Object {
            choice: &prepared.choice,
            number: prepared.number,
            touch: self.press.touches.get(slot)?,
            height_m: *self.state().heights_m.get(slot)?,
        })
    }

    pub(crate) fn objects(&self) -> usize {
        self.press.touches.len()
    }

    pub(crate) fn skin_seed(&self) -> u64 {
        self.skin.seed
    }

    pub(crate) fn session(&self) -> u64 {
        self.skin.number
    }

    pub(crate) fn faults(&self) -> usize {
        self.skin.faults
    }

    pub(crate) fn presses_before(&self) -> usize {
        self.press.presses_before
    }

    /// Codes of the converter; 0 without one.
    pub(crate) fn codes(&self) -> impl Iterator<Item = u32> + 'a {
        let converter = self.skin.compressive.info().converter;
        self.volts()
            .iter()
            .map(move |v| converter.and_then(|c| c.code(*v)).unwrap_or_default())
    }
}
