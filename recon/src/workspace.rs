//! Scratch memory that calls share.

use std::any::{Any, TypeId};
use std::fmt;

/// Scratch memory reused between calls, so that a decode allocates only its result.
///
/// Every method defines its memory as a type. The workspace holds one value of each requested type and returns the same
/// value next time. A method must not depend on the earlier content of its value.
///
/// ```
/// use spts_recon::Workspace;
///
/// #[derive(Debug, Default)]
/// struct Residual(Vec<f64>);
///
/// let mut work = Workspace::default();
/// work.scratch::<Residual>().0.resize(20, 0.0);
/// // the memory is still there
/// assert_eq!(work.scratch::<Residual>().0.len(), 20);
/// ```
#[derive(Default)]
pub struct Workspace {
    /// One value for each type. There are only a few, so they are searched linearly.
    values: Vec<(TypeId, Box<dyn Any + Send + Sync>)>,
}

impl Workspace {
    /// The workspace's value of type `T`. The first call creates it as `T::default()`.
    ///
    /// # Panics
    /// Never: a value is stored under its own type.
    pub fn scratch<T: Any + Default + Send + Sync>(&mut self) -> &mut T {
        let id = TypeId::of::<T>();
        let found = self.values.iter().position(|(other, _)| *other == id);
        let index = found.unwrap_or_else(|| {
            self.values.push((id, Box::<T>::default()));
            self.values.len() - 1
        });
        match self.values[index].1.downcast_mut() {
            Some(value) => value,
            None => unreachable!("a value is kept under its own type"),
        }
    }
}

impl fmt::Debug for Workspace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Workspace({} kinds of scratch memory)", self.values.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_has_a_value_of_its_own() {
        let mut work = Workspace::default();
        work.scratch::<Vec<f64>>().push(1.0);
        work.scratch::<Vec<usize>>().push(2);
        assert_eq!(work.scratch::<Vec<f64>>(), &[1.0]);
        assert_eq!(work.scratch::<Vec<usize>>(), &[2]);
        assert_eq!(format!("{work:?}"), "Workspace(2 kinds of scratch memory)");
    }
}
