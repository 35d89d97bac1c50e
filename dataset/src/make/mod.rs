//! Makes rows. Each is a function of the specification and its number.

#[cfg(feature = "mujoco")]
mod engine;
mod error;
mod held;
mod moving;
mod press;
mod row;
mod skin;
mod split;
mod touch;

pub use error::{RowCause, RowError};
pub(crate) use row::Object;
pub use row::Row;
pub(crate) use touch::Ball;

use crate::spec::{Choice, Spec, whole};
use held::{Field, Held};
use moving::Moving;
use press::Press;
use skin::Skin;
use spts_models::Streams;

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
pub(crate) struct Prepared {
    number: u64,
    choice: Choice,
    field: Option<Field>,
}

impl Prepared {
    fn new(spec: &Spec, number: u64) -> Result<Self, RowCause> {
        let choice = spec.choices().shape(spec.streams(), number)?;
        let field = if spec.is_moving() {
            None
        } else {
            Some(Field::new(spec, &choice)?)
        };
        Ok(Self { number, choice, field })
    }
}

impl<'a> Maker<'a> {
    /// A maker for `spec`.
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
    /// [`RowError`] if the drawn objects cannot be pressed or recorded.
    pub fn row(&mut self, index: u64) -> Result<Row<'_>, RowError> {
        let windows = self.spec.windows();
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
        let spec = self.spec;
        let row = number * spec.windows();
        let skin_number = row / spec.rows_per_skin();
        if self.skin.as_ref().is_none_or(|skin| skin.number != skin_number) {
            self.skin = None;
            self.skin = Some(Skin::new(spec, skin_number)?);
        }
        let group = row / spec.rows_per_shape();
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
    fn shape(&mut self, slot: usize, number: u64) -> Result<(&Choice, Option<&mut Field>), RowCause> {
        match self.shapes.get(slot) {
            Some(prepared) if prepared.number == number => {}
            Some(_) => self.shapes[slot] = Prepared::new(self.spec, number)?,
            None => self.shapes.push(Prepared::new(self.spec, number)?),
        }
        let prepared = &mut self.shapes[slot];
        Ok((&prepared.choice, prepared.field.as_mut()))
    }

    /// The objects of press `number`, the shapes of group `group`.
    fn held(&mut self, number: u64, group: u64) -> Result<Vec<Held>, RowCause> {
        let (spec, streams) = (self.spec, self.streams);
        let most = spec.most_objects();
        let count = whole(spec.config().object.count.value(streams, "object.count", number)).min(most);
        let mut held: Vec<Held> = Vec::with_capacity(count);
        for (slot, shape) in (0..count).zip(group * most as u64..) {
            let drawn = if slot == 0 {
                streams
            } else {
                streams.child("object", slot as u64)
            };
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
