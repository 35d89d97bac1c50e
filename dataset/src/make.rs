//! Makes rows. Each is a function of the specification and its number.

mod engine;
mod press;
mod touch;

use crate::spec::{Choice, Spec, SplitBy, whole};
use press::{Press, Skin, State};
use rand::RngExt as _;
use spts::Refusal;
use spts_models::{ConductanceMap, PressureMap, Streams};
use std::sync::Arc;
use touch::{Field, Held, Moving, Touch};

/// Makes the rows of a data set. It keeps intermediate results that consecutive rows share; rows do not depend on them.
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

/// A shape, with the field that has been prepared for its mesh where shapes are only held.
struct Prepared {
    number: u64,
    choice: Choice,
    field: Option<Field>,
}

impl Prepared {
    fn new(spec: &Spec, number: u64) -> Result<Self, Refusal> {
        let choice = spec.choices().shape(spec.streams(), number)?;
        let field = if spec.is_moving() { None } else { Some(Field::new(spec, &choice)?) };
        Ok(Self { number, choice, field })
    }
}

impl<'a> Maker<'a> {
    /// A maker for `spec`.
    pub fn new(spec: &'a Spec) -> Self {
        Self { streams: spec.streams(), spec, shapes: Vec::new(), skin: None, press: None }
    }

    /// Row number `index`.
    ///
    /// # Errors
    /// [`Refusal`] if the drawn objects cannot be pressed or recorded.
    pub fn row(&mut self, index: u64) -> Result<Row<'_>, Refusal> {
        let windows = self.spec.windows();
        let number = index / windows;
        let failed = |refusal: Refusal| refusal.at(format!("data set \"{}\", row {index}", self.spec.config().name));
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

    fn press(&mut self, number: u64) -> Result<Press, Refusal> {
        let spec = self.spec;
        let row = number * spec.windows();
        let skin_number = row / spec.rows_per_skin();
        if self.skin.as_ref().is_none_or(|skin| skin.number != skin_number) {
            self.skin = None;
            self.skin = Some(Skin::new(spec, skin_number)?);
        }
        let group = row / spec.rows_per_shape();
        if let Some(law) = spec.frame_law() {
            let (choice, _) = self.shape(0, group)?;
            let Some(frames) = choice.frames.clone() else { unreachable!("every choice of frames is a press") };
            return Press::of_frames(spec, self.skin_made(), number, (&frames, law));
        }
        if spec.is_moving() {
            let (choice, _) = self.shape(0, group)?;
            let moving = Moving::new(spec, choice, spec.streams(), number)?;
            return Press::of_moving(spec, self.skin_made(), number, moving);
        }
        let held = self.held(number, group)?;
        Press::of_held(spec, self.skin_made(), number, held)
    }

    fn skin_made(&mut self) -> &mut Skin {
        let Some(skin) = &mut self.skin else {
            unreachable!("a skin is made before a press");
        };
        skin
    }

    /// Shape number `number`, at place `slot` of the press.
    fn shape(&mut self, slot: usize, number: u64) -> Result<(&Choice, Option<&mut Field>), Refusal> {
        match self.shapes.get(slot) {
            Some(prepared) if prepared.number == number => {}
            Some(_) => self.shapes[slot] = Prepared::new(self.spec, number)?,
            None => self.shapes.push(Prepared::new(self.spec, number)?),
        }
        let prepared = &mut self.shapes[slot];
        Ok((&prepared.choice, prepared.field.as_mut()))
    }

    /// The objects of press `number`, the shapes of group `group`.
    fn held(&mut self, number: u64, group: u64) -> Result<Vec<Held>, Refusal> {
        let (spec, streams) = (self.spec, self.streams);
        let most = spec.most_objects();
        let count = whole(spec.config().object.count.value(streams, "object.count", number)).min(most);
        let mut held: Vec<Held> = Vec::with_capacity(count);
        for (slot, shape) in (0..count).zip(group * most as u64..) {
            let drawn = if slot == 0 { streams } else { streams.child("object", slot as u64) };
            let (choice, Some(field)) = self.shape(slot, shape)? else {
                unreachable!("shapes that are held have a field");
            };
            match field.press(spec, choice, drawn, number, &held)? {
                Some(object) => held.push(object),
                // there is no room for one more
                None => break,
            }
        }
        Ok(held)
    }
}

/// One row of a data set: a window of samples with its truth.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub(crate) index: u64,
    pub(crate) window: usize,
    pub(crate) spec: &'a Spec,
    pub(crate) press: &'a Press,
    /// Shapes of the press, at least one.
    shapes: &'a [Prepared],
    pub(crate) skin: &'a Skin,
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
    /// `train`, `validation` or `test`.
    pub fn split(&self) -> &'static str {
        split(self.spec, self.press.number, self.shapes[0].number)
    }

    /// Name of the first object that is pressed; of a procedural shape, the name of its family.
    pub fn name(&self) -> Arc<str> {
        Arc::clone(&self.shapes[0].choice.name)
    }

    /// Mean pressure over every taxel's area, Pa.
    pub fn pressure(&self) -> &'a PressureMap {
        &self.state().pressure
    }

    /// Conductance of every taxel, S.
    pub fn conductance(&self) -> &'a ConductanceMap {
        &self.state().conductance
    }

    /// The raster scan, V; empty if none is recorded.
    pub fn image(&self) -> &'a [f64] {
        &self.state().image
    }

    /// The samples of the window, V.
    pub fn volts(&self) -> &'a [f64] {
        let m = self.spec.config().record.measurements;
        &self.press.volts[self.window * m..][..m]
    }

    /// Row of Φ at the first measurement of the window, counted from loading the seeds.
    pub fn first_row(&self) -> u64 {
        self.press.first_row + self.spec.timing().row_of(self.window as u64)
    }

    /// Φ of the window: measurements × taxels, row-major.
    pub fn phi(&self) -> Vec<f64> {
        let m = self.spec.config().record.measurements;
        let mut phi = vec![0.0; m * self.spec.skin().taxels()];
        self.skin.compressive.weights().fill_rows(self.first_row(), &mut phi);
        phi
    }

    /// Time from the touch to the first measurement of the window, s; negative before the touch.
    pub fn time_s(&self) -> f64 {
        let timing = self.spec.timing();
        self.press.start_s + timing.row_of(self.window as u64) as f64 / timing.rate_hz
    }

    /// Normal force on the skin, N: the sum of pressure × area.
    pub fn contact_force_n(&self) -> f64 {
        self.pressure().sum() * self.spec.skin().cell_area_m2()
    }

    /// Number of saturated samples in the window and in the raster scan.
    pub(crate) fn saturated(&self) -> [usize; 2] {
        let [wire_v, raster_v] = self.skin.rails_v;
        [
            self.skin.compressive.info().saturated(self.volts(), wire_v),
            self.skin.raster.info().saturated(self.image(), raster_v),
        ]
    }

    fn state(&self) -> &'a State {
        self.press.state(self.window)
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

    /// Codes of the converter; 0 without one.
    pub(crate) fn codes(&self) -> impl Iterator<Item = u32> + 'a {
        let converter = self.skin.compressive.info().converter;
        self.volts().iter().map(move |v| converter.and_then(|c| c.code(*v)).unwrap_or_default())
    }
}

/// The split of press number `press`, whose first shape has the number `shape`: `train`, `validation` or `test`.
fn split(spec: &Spec, press: u64, shape: u64) -> &'static str {
    let of_frames = spec.frame_law().is_some();
    let number = match spec.split_by() {
        // a press of frames comes again, with other noise
        SplitBy::Press if of_frames => shape % spec.choices().count(),
        SplitBy::Object if of_frames => u64::try_from(spec.choices().label(shape)).unwrap_or_default(),
        SplitBy::Press => press,
        // every number is another procedural shape; a mesh file or an object comes again
        SplitBy::Object if spec.choices().are_procedural() => shape,
        SplitBy::Object => shape % spec.choices().count(),
    };
    let shares = &spec.config().split;
    let at: f64 = spec.streams().rng("split", number).random();
    if at < shares.test {
        "test"
    } else if at < shares.test + shares.validation {
        "validation"
    } else {
        "train"
    }
}
