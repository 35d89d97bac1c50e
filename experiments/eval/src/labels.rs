//! Numbers of classes, as dictionaries, libraries and external programs use them.

use spts_contact::objects::OBJECTS;

/// Names of the classes. The published objects have the numbers 1 to 17; other objects have the following numbers.
/// Number 0 is the empty skin.
///
/// ```
/// use spts_eval::Labels;
///
/// let mut labels = Labels::of(["cup"]);
/// assert_eq!(labels.number("T").map(|number| number <= 17), Some(true));
/// assert_eq!((labels.number("cup"), labels.add("pen")), (Some(18), 19));
/// assert_eq!(labels.name(19), Some("pen"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    names: Vec<String>,
}

impl Default for Labels {
    fn default() -> Self {
        let published = OBJECTS.iter().map(|object| object.name.to_owned());
        Self { names: std::iter::once("empty".to_owned()).chain(published).collect() }
    }
}

impl Labels {
    /// Numbers `objects` in their order, after the published ones.
    pub fn of<'a>(objects: impl IntoIterator<Item = &'a str>) -> Self {
        let mut labels = Self::default();
        for object in objects {
            labels.add(object);
        }
        labels
    }

    /// Number of `object`, which is added if it is new.
    pub fn add(&mut self, object: &str) -> usize {
        self.number(object).unwrap_or_else(|| {
            self.names.push(object.to_owned());
            self.names.len() - 1
        })
    }

    /// Number of `object`.
    pub fn number(&self, object: &str) -> Option<usize> {
        self.names.iter().position(|name| name == object)
    }

    /// All names, in the order of their numbers.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Name of class `number`.
    pub fn name(&self, number: usize) -> Option<&str> {
        self.names.get(number).map(String::as_str)
    }
}
