//! Decoders that have learned and rows that are designed, kept for all pages; what is not there yet is made beside the
//! updates.

use crate::error::LiveError;
use crate::options::MEASUREMENTS;
use spts_circuit::Patterns;
use spts_eval::algorithm::Trained;
use spts_eval::decoders::{DecoderSpec, Needs};
use spts_eval::training::TrainingData;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{Designer, Expected, RowTask, Tolerances};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// What decoders and designers know is the same for every seed of the skin: the root of its random numbers.
const SEED: u64 = 0;

/// A decoder that has learned.
pub(crate) type Decoder = Box<dyn Trained>;
/// Rows in the order of their worth.
pub(crate) type Design = Matrix;

/// Something that takes time to make.
pub(crate) enum Made<T> {
    /// It is being made.
    Waiting,
    Ready(Arc<T>),
    /// Why it cannot be made.
    Refused(String),
}

/// What has been asked for so far, by name.
type ByName<T> = Mutex<BTreeMap<&'static str, Made<T>>>;

impl<T> Clone for Made<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Waiting => Self::Waiting,
            Self::Ready(made) => Self::Ready(Arc::clone(made)),
            Self::Refused(reason) => Self::Refused(reason.clone()),
        }
    }
}

/// Decoders and designed rows for the published layout, shared by all sessions. Each is made once, when it is first
/// asked for, on a thread of its own.
#[derive(Default)]
pub struct Shelf {
    layout: SkinLayout,
    decoders: ByName<Decoder>,
    designs: ByName<Design>,
    /// One thing at a time is made.
    making: Mutex<()>,
    outlines: OnceLock<Result<TrainingData, String>>,
    shapes: OnceLock<Result<TrainingData, String>>,
}

impl Shelf {
    /// An empty one.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The skin that everything is for.
    #[must_use]
    pub fn layout(&self) -> &SkinLayout {
        &self.layout
    }

    /// The decoder, as far as it is.
    pub(crate) fn decoder(self: &Arc<Self>, spec: &'static DecoderSpec) -> Made<Decoder> {
        self.get(
            |shelf| &shelf.decoders,
            spec.name,
            move |shelf| {
                let data = match spec.needs {
                    Needs::Shapes => shelf.shapes()?,
                    _ => shelf.outlines()?,
                };
                (spec.train)(data).map_err(|e| e.to_string())
            },
        )
    }

    /// As many rows of `designer` as the largest M, as far as they are.
    pub(crate) fn design(self: &Arc<Self>, designer: &'static Designer) -> Made<Design> {
        self.get(
            |shelf| &shelf.designs,
            designer.name,
            move |shelf| {
                let prior = shelf.outlines()?.prior(ImagePrior::UNSEEN).map_err(|e| e.to_string())?;
                let shape = [shelf.layout.rows(), shelf.layout.cols()];
                let expected = Expected::like(&prior, shape, Tolerances::default());
                let expected = expected.map_err(|e| e.to_string())?;
                let task = RowTask::new(MEASUREMENTS[1].min(shelf.layout.taxels()), &expected);
                (designer.build)().design(&task).map_err(|e| e.to_string())
            },
        )
    }

    /// What is on `shelf` under `name`; begins to make it when nothing is.
    fn get<T: Send + Sync + 'static>(
        self: &Arc<Self>,
        table: fn(&Self) -> &ByName<T>,
        name: &'static str,
        make: impl FnOnce(&Self) -> Result<T, String> + Send + 'static,
    ) -> Made<T> {
        let mut known = locked(table(self));
        if let Some(made) = known.get(name) {
            return made.clone();
        }
        let shelf = Arc::clone(self);
        let started = std::thread::Builder::new().name(format!("make {name}")).spawn(move || {
            let one = locked(&shelf.making);
            // pages wait for it: it is refused, too, when it panics
            let made = catch_unwind(AssertUnwindSafe(|| make(&shelf)));
            drop(one);
            let made = match made {
                Ok(Ok(made)) => Made::Ready(Arc::new(made)),
                Ok(Err(reason)) => Made::Refused(reason),
                Err(_) => Made::Refused("an error of the program; its standard error says more".to_owned()),
            };
            locked(table(&shelf)).insert(name, made);
        });
        let made = match started {
            Ok(_) => Made::Waiting,
            Err(error) => Made::Refused(error.to_string()),
        };
        known.insert(name, made.clone());
        made
    }

    /// Random outlines, for priors and dictionary.
    fn outlines(&self) -> Result<&TrainingData, String> {
        let learn = || TrainingData::for_layout(&self.layout, Streams::new(SEED)).map_err(|e| e.to_string());
        self.outlines.get_or_init(learn).as_ref().map_err(String::clone)
    }

    /// Simulated shapes.
    fn shapes(&self) -> Result<&TrainingData, String> {
        let learn = || TrainingData::for_shapes(&self.layout, Streams::new(SEED)).map_err(|e| e.to_string());
        self.shapes.get_or_init(learn).as_ref().map_err(String::clone)
    }
}

/// The first `count` rows as a pattern that repeats.
pub(crate) fn first_rows(design: &Design, count: usize) -> Result<Patterns, LiveError> {
    let count = count.min(design.nrows());
    let patterns = Patterns::of_levels(count, &design.view().values()[..count * design.ncols()]);
    patterns.map_err(|e| LiveError::Message(e.to_string()))
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
