//! Rows: each a function of the spec and its number, and of nothing else.

mod error;
mod skin;
mod touch;

pub use error::{RowCause, RowError};
pub(crate) use touch::Touch;

use crate::spec::{Choice, ObjectSource, Spec, SplitBy, whole};
use rand::RngExt as _;
use skin::Skin;
use spts_circuit::Constant;
use spts_models::{ConductanceMap, PressureMap, Streams};
use touch::Prepared;

/// Frames between loading the seeds and the first press, and from press to press, as on the device.
const LEAD_FRAMES: u64 = 243;
const PRESS_FRAMES: u64 = 1057;
/// Measurements from the start of a press to the first window, least and most: the published hold.
const HOLD_MEASUREMENTS: std::ops::Range<u64> = 50_000..70_000;

/// Makes the rows of a data set. It keeps what the last row had in common with the next; the rows do not depend on
/// that.
///
/// ```
/// use spts_dataset::{Maker, Spec};
///
/// let spec = Spec::load("random-shapes", &toml::Table::new())?;
/// let mut maker = Maker::new(&spec);
/// let row = maker.row(7)?;
/// assert_eq!((row.pressure().values().len(), row.volts().len()), (100, 20));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Maker<'a> {
    spec: &'a Spec,
    streams: Streams,
    /// Shapes of the last press.
    shapes: Vec<Prepared>,
    skin: Option<Skin>,
    press: Option<Press>,
}

/// One press and its recordings.
struct Press {
    number: u64,
    touches: Vec<Touch>,
    pressure: PressureMap,
    conductance: ConductanceMap,
    image: Vec<f64>,
    volts: Vec<f64>,
    /// Row of Φ of the first measurement.
    first_row: u64,
    hold_s: f64,
    presses_before: usize,
    split: &'static str,
}

/// One row of a data set.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    index: u64,
    window: usize,
    spec: &'a Spec,
    press: &'a Press,
    shapes: &'a [Prepared],
    skin: &'a Skin,
}

impl<'a> Maker<'a> {
    /// A maker that has made nothing yet.
    #[must_use]
    pub fn new(spec: &'a Spec) -> Self {
        Self {
            streams: spec.streams(),
            spec,
            shapes: Vec::new(),
            skin: None,
            press: None,
        }
    }

    /// Row number `index`.
    ///
    /// # Errors
    /// [`RowError`] when what is drawn for it cannot be pressed or recorded.
    pub fn row(&mut self, index: u64) -> Result<Row<'_>, RowError> {
        let windows = self.spec.config().record.windows;
        let number = index / windows;
        let failed = |cause| RowError { index, cause };
        if self.press.as_ref().is_none_or(|press| press.number != number) {
            self.press = None;
            self.press = Some(self.press(number).map_err(failed)?);
        }
        let (Some(press), Some(skin)) = (&self.press, &self.skin) else {
            unreachable!("a press was made on a skin");
        };
        Ok(Row {
            index,
            window: usize::try_from(index % windows).unwrap_or_default(),
            spec: self.spec,
            press,
            shapes: &self.shapes[..press.touches.len()],
            skin,
        })
    }

    fn press(&mut self, number: u64) -> Result<Press, RowCause> {
        let (spec, streams) = (self.spec, self.streams);
        let config = spec.config();
        let row = number * config.record.windows;
        let skin_number = row / spec.rows_per_skin();
        if self.skin.as_ref().is_none_or(|skin| skin.number != skin_number) {
            self.skin = None;
            self.skin = Some(Skin::new(spec, skin_number)?);
        }
        let group = row / spec.rows_per_shape();
        let touches = self.touches(number, group)?;
        let Some(skin) = &mut self.skin else {
            unreachable!("just made");
        };
        let pressure = sum(spec, &touches, |touch| &touch.pressure);
        let electrode_pressure = sum(spec, &touches, |touch| &touch.electrode_pressure);
        let hold_s = config.press.hold_s.value(streams, "press.hold_s", number);
        let before = whole(config.skin.presses_before.value(streams, "skin.presses_before", number));
        let mut sheet = skin.fresh.clone();
        for _press in 0..before {
            sheet.hold(&electrode_pressure, hold_s);
            sheet.rest();
        }
        let conductance = sheet.hold(&electrode_pressure, hold_s);
        let mut source = Constant::new(conductance.clone())?;
        let block = number % (spec.rows_per_skin() / config.record.windows);
        let taxels = spec.skin().taxels();
        let frame = LEAD_FRAMES + PRESS_FRAMES * block;
        let hold = streams.rng("hold", number).random_range(HOLD_MEASUREMENTS);
        let first_row = frame * taxels as u64 + hold;
        skin.compressive.seek_row(block, first_row);
        let measurements = whole(config.record.windows as f64) * config.record.measurements;
        let volts = skin.compressive.measure(&mut source, measurements)?;
        let image = if config.record.raster {
            skin.raster.seek(block, frame);
            skin.raster.measure(&mut source, taxels)?
        } else {
            Vec::new()
        };
        let by_shape = match config.split.by {
            Some(by) => by == SplitBy::Object,
            None => config.object.from != ObjectSource::Objects,
        };
        Ok(Press {
            number,
            touches,
            pressure,
            conductance,
            image,
            volts,
            first_row,
            hold_s,
            presses_before: before,
            split: split(spec, if by_shape { group_of_split(spec, group) } else { number }),
        })
    }

    /// The objects of press `number`, the shapes of group `group`.
    fn touches(&mut self, number: u64, group: u64) -> Result<Vec<Touch>, RowCause> {
        let (spec, streams) = (self.spec, self.streams);
        let most = spec.most_objects();
        let count = whole(spec.config().object.count.value(streams, "object.count", number)).min(most);
        let mut touches = Vec::with_capacity(count);
        for (slot, shape) in (0..count).zip(group * most as u64..) {
            match self.shapes.get(slot) {
                Some(prepared) if prepared.number == shape => {}
                Some(_) => self.shapes[slot] = Prepared::new(spec, shape)?,
                None => self.shapes.push(Prepared::new(spec, shape)?),
            }
            let drawn = if slot == 0 {
                streams
            } else {
                streams.child("object", slot as u64)
            };
            match self.shapes[slot].press(spec, drawn, number, &touches)? {
                Some(touch) => touches.push(touch),
                // there is no room for one more
                None => break,
            }
        }
        Ok(touches)
    }
}

/// What is never divided between two splits, of the shapes of group `group`: the same mesh file comes again.
fn group_of_split(spec: &Spec, group: u64) -> u64 {
    if spec.choices().are_procedural() {
        group
    } else {
        group % spec.choices().classes().len() as u64
    }
}

/// The split that `group` belongs to.
fn split(spec: &Spec, group: u64) -> &'static str {
    let shares = &spec.config().split;
    let at: f64 = spec.streams().rng("split", group).random();
    if at < shares.test {
        "test"
    } else if at < shares.test + shares.validation {
        "validation"
    } else {
        "train"
    }
}

fn sum(spec: &Spec, touches: &[Touch], of: fn(&Touch) -> &PressureMap) -> PressureMap {
    let mut total = PressureMap::zeros(spec.skin().rows(), spec.skin().cols());
    for touch in touches {
        for (total, p) in total.values_mut().iter_mut().zip(of(touch).values()) {
            *total += p;
        }
    }
    total
}

impl<'a> Row<'a> {
    /// Number of the row.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Number of the press, of which a row is one window.
    #[must_use]
    pub fn press(&self) -> u64 {
        self.press.number
    }

    /// `train`, `validation` or `test`.
    #[must_use]
    pub fn split(&self) -> &'static str {
        self.press.split
    }

    /// Mean pressure over every taxel's cell, Pa.
    #[must_use]
    pub fn pressure(&self) -> &'a PressureMap {
        &self.press.pressure
    }

    /// Conductance of every taxel, S.
    #[must_use]
    pub fn conductance(&self) -> &'a ConductanceMap {
        &self.press.conductance
    }

    /// The raster scan, V; empty where none is recorded.
    #[must_use]
    pub fn image(&self) -> &'a [f64] {
        &self.press.image
    }

    /// The samples of the window, V.
    #[must_use]
    pub fn volts(&self) -> &'a [f64] {
        let m = self.spec.config().record.measurements;
        &self.press.volts[self.window * m..][..m]
    }

    /// Rows of Φ since the seeds were loaded, before the first measurement of the window.
    #[must_use]
    pub fn first_row(&self) -> u64 {
        let m = self.spec.config().record.measurements;
        self.press.first_row + (self.window * m) as u64
    }

    /// Φ of the window: measurements × taxels, row by row.
    #[must_use]
    pub fn phi(&self) -> Vec<f64> {
        let m = self.spec.config().record.measurements;
        let mut phi = vec![0.0; m * self.spec.skin().taxels()];
        self.skin.compressive.weights().fill_rows(self.first_row(), &mut phi);
        phi
    }

    /// Time from the touch to the first measurement of the window, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        let before = self.window * self.spec.config().record.measurements;
        self.press.hold_s + before as f64 / self.skin.compressive.sample_rate_hz()
    }

    /// Number of samples at an end of their range: of the window, and of the raster scan.
    #[must_use]
    pub fn saturated(&self) -> [usize; 2] {
        let [wire_v, raster_v] = self.skin.rails_v;
        [
            self.skin.compressive.info().saturated(self.volts(), wire_v),
            self.skin.raster.info().saturated(self.image(), raster_v),
        ]
    }

    pub(crate) fn spec(&self) -> &'a Spec {
        self.spec
    }

    pub(crate) fn window(&self) -> usize {
        self.window
    }

    /// Object number `slot` and its touch, if there are so many.
    pub(crate) fn object(&self, slot: usize) -> Option<(&'a Choice, u64, &'a Touch)> {
        let prepared = self.shapes.get(slot)?;
        Some((&prepared.choice, prepared.number, self.press.touches.get(slot)?))
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
