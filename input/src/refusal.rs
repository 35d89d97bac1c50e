//! The one error of what comes in from outside.

use std::error::Error;
use std::fmt::{self, Display};
use std::path::Path;
use std::sync::Arc;

/// Most characters of a value that a refusal repeats.
const MOST_OF_VALUE: usize = 160;

/// Why something was refused, as one sentence that names the field, its value and what is valid.
///
/// It is the error of everything whose cause nobody tells apart; an enum of its own has only what somebody matches.
///
/// ```
/// use spts_input::Refusal;
///
/// let error = Refusal::range("force_n", 700.0, "[0.5, 100]").at("press");
/// assert_eq!(error.to_string(), "press: `force_n` = 700 is outside [0.5, 100]");
/// ```
#[derive(Debug, Clone)]
pub struct Refusal {
    message: String,
    source: Option<Arc<dyn Error + Send + Sync>>,
}

impl Refusal {
    /// A refusal that says `message`.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), source: None }
    }

    /// The value of a field that is outside its valid range, such as "[0.5, 100]".
    pub fn range(field: &str, value: impl Display, range: impl Display) -> Self {
        let value = value.to_string();
        let value = match value.char_indices().nth(MOST_OF_VALUE) {
            Some((end, _)) => format!("{}…", &value[..end]),
            None => value,
        };
        Self::new(format!("`{field}` = {value} is outside {range}"))
    }

    /// What `source` says, with `source` kept.
    pub fn from_error(source: impl Error + Send + Sync + 'static) -> Self {
        Self { message: source.to_string(), source: Some(Arc::new(source)) }
    }

    /// What a reader or writer of the file at `path` says, with the path before it.
    pub fn in_file<E: Error + Send + Sync + 'static>(path: &Path) -> impl Fn(E) -> Self + use<E> {
        let path = path.to_owned();
        move |source| Self::from_error(source).at(path.display())
    }

    /// The same refusal with the place of the mistake before it: a file, or the section of one.
    pub fn at(self, place: impl Display) -> Self {
        self.reworded(|message| format!("{place}: {message}"))
    }

    /// The same refusal in other words.
    pub fn reworded(self, words: impl FnOnce(&str) -> String) -> Self {
        Self { message: words(&self.message), ..self }
    }
}

impl Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Refusal {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.source.as_deref().map(|source| source as &(dyn Error + 'static))
    }
}

/// Two refusals are equal if they say the same.
impl PartialEq for Refusal {
    fn eq(&self, other: &Self) -> bool {
        self.message == other.message
    }
}

impl From<super::InputError> for Refusal {
    fn from(error: super::InputError) -> Self {
        Self::from_error(error)
    }
}
