//! State that outlives the object that has it.

use crate::streams::Streams;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;
use spts_input::Refusal;

/// The state of something that is built from parameters: what it remembers beside them, as numbers.
///
/// What has a state names its variables once, in one order; the same function saves and loads them. What was built with
/// the same parameters and loads the numbers goes on as the original, bit for bit.
///
/// ```
/// use spts_models::Snapshot;
///
/// struct Mean {
///     sum: f64,
///     count: u64,
/// }
///
/// impl Mean {
///     fn exchange(&mut self, state: &mut Snapshot) {
///         state.f64(&mut self.sum);
///         state.u64(&mut self.count);
///     }
/// }
/// let mut saving = Snapshot::saving();
/// Mean { sum: 1.5, count: 2 }.exchange(&mut saving);
/// let (mut copy, mut loading) = (Mean { sum: 0.0, count: 0 }, Snapshot::loading(saving.finish()?));
/// copy.exchange(&mut loading);
/// loading.finish()?;
/// assert_eq!((copy.sum, copy.count), (1.5, 2));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug)]
pub struct Snapshot {
    words: Vec<u64>,
    /// Number of words that have been loaded; `None` while they are saved.
    loaded: Option<usize>,
}

impl Snapshot {
    /// Variables are saved.
    pub fn saving() -> Self {
        Self { words: Vec::new(), loaded: None }
    }

    /// Variables are loaded from `words`, which [`Snapshot::finish`] gave.
    pub fn loading(words: Vec<u64>) -> Self {
        Self { words, loaded: Some(0) }
    }

    /// The words that were saved.
    ///
    /// # Errors
    /// [`Refusal`] when there were more or fewer words than variables that were loaded.
    pub fn finish(self) -> Result<Vec<u64>, Refusal> {
        match self.loaded {
            Some(loaded) if loaded != self.words.len() => {
                let found = self.words.len();
                Err(Refusal::new(format!(
                    "a state of {found} numbers, where {loaded} are needed: it is of another object"
                )))
            }
            _ => Ok(self.words),
        }
    }

    /// Saves or loads a whole number. A variable beyond the last word keeps its value.
    pub fn u64(&mut self, value: &mut u64) {
        match &mut self.loaded {
            None => self.words.push(*value),
            Some(loaded) => {
                *value = self.words.get(*loaded).copied().unwrap_or(*value);
                *loaded += 1;
            }
        }
    }

    /// Saves or loads a number, to the bit.
    pub fn f64(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.u64(&mut bits);
        *value = f64::from_bits(bits);
    }

    /// Saves or loads numbers; there must be as many when they are loaded.
    pub fn f64s<'a>(&mut self, values: impl IntoIterator<Item = &'a mut f64>) {
        values.into_iter().for_each(|value| self.f64(value));
    }

    /// Saves or loads a list of any length.
    pub fn u32s(&mut self, values: &mut Vec<u32>) {
        let mut count = values.len() as u64;
        self.u64(&mut count);
        // no list is longer than all that was saved
        let most = if self.loaded.is_some() { self.words.len() } else { values.len() };
        values.resize(usize::try_from(count).unwrap_or(usize::MAX).min(most), 0);
        for value in values {
            let mut word = u64::from(*value);
            self.u64(&mut word);
            *value = u32::try_from(word).unwrap_or(u32::MAX);
        }
    }

    /// Saves or loads a flag.
    pub fn flag(&mut self, value: &mut bool) {
        let mut word = u64::from(*value);
        self.u64(&mut word);
        *value = word != 0;
    }

    /// Saves or loads which random streams these are.
    pub fn streams(&mut self, streams: &mut Streams) {
        self.u64(streams.root_mut());
    }

    /// Saves or loads a random generator and its place in its sequence.
    pub fn rng(&mut self, rng: &mut ChaCha8Rng) {
        let (mut seed, mut stream, place) = (rng.get_seed(), rng.get_stream(), rng.get_word_pos());
        for bytes in seed.as_chunks_mut::<8>().0 {
            let mut word = u64::from_le_bytes(*bytes);
            self.u64(&mut word);
            *bytes = word.to_le_bytes();
        }
        self.u64(&mut stream);
        // a sequence is 2^68 words long; nobody gets beyond 2^64
        let mut word = u64::try_from(place).unwrap_or(u64::MAX);
        self.u64(&mut word);
        if self.loaded.is_some() {
            *rng = ChaCha8Rng::from_seed(seed);
            rng.set_stream(stream);
            rng.set_word_pos(word.into());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt as _;

    #[test]
    fn a_generator_goes_on() {
        let mut rng = Streams::new(3).rng("noise", 7);
        let _: [f64; 37] = rng.random();
        let mut saving = Snapshot::saving();
        saving.rng(&mut rng);
        let (mut copy, mut loading) = (Streams::new(0).rng("", 0), Snapshot::loading(saving.finish().unwrap()));
        loading.rng(&mut copy);
        loading.finish().unwrap();
        assert_eq!(copy.random::<[u64; 100]>(), rng.random::<[u64; 100]>());
    }

    #[test]
    fn lists_have_any_length() {
        let (mut list, mut saving) = (vec![7, 0, u32::MAX], Snapshot::saving());
        saving.u32s(&mut list);
        let (mut copy, words) = (vec![1; 5], saving.finish().unwrap());
        let mut loading = Snapshot::loading(words.clone());
        loading.u32s(&mut copy);
        loading.finish().unwrap();
        assert_eq!((&copy, words.len()), (&list, 4));
        // a length that cannot be
        let mut loading = Snapshot::loading(vec![u64::MAX, 3]);
        loading.u32s(&mut copy);
        assert!(loading.finish().is_err() && copy.len() <= 2);
    }

    #[test]
    fn the_state_of_something_else_is_refused() {
        for words in [vec![], vec![1, 2, 3]] {
            let found = words.len();
            let mut loading = Snapshot::loading(words);
            loading.f64s(&mut [0.0; 2]);
            let error = loading.finish().unwrap_err().to_string();
            assert!(error.contains(&format!("{found} numbers, where 2 are needed")), "{error}");
        }
    }
}
