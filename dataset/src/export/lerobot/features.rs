//! The features of a frame; the table below has one line a feature.

use crate::error::DatasetError;
use crate::export::rows::RowView;
use crate::spec::{Label, Spec};

/// Type of a feature's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    F32,
    I64,
}

impl Scalar {
    /// The type in LeRobot's words.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::F32 => "float32",
            Self::I64 => "int64",
        }
    }

    /// Bytes of a value.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::I64 => 8,
        }
    }
}

/// Adds the values of a row to those of the episode.
type Fill = fn(&RowView<'_>, &mut Vec<f64>) -> Result<(), DatasetError>;

/// Where the values of a feature come from.
#[derive(Clone, Copy)]
pub(super) enum Source {
    /// The columns of the row.
    Row(Fill),
    /// The state in the next frame; in the last frame, its own state.
    NextState,
    /// Frame number within the episode, divided by the frame rate.
    Timestamp,
    /// Number of the frame within its episode.
    Frame,
    /// Number of the episode.
    Episode,
    /// Number of the frame within the data set.
    Index,
    /// Number of the task.
    Task,
}

/// A feature of the frames of a data set.
pub(super) struct Feature {
    pub(super) key: &'static str,
    pub(super) scalar: Scalar,
    /// One or two sides.
    pub(super) shape: Vec<usize>,
    pub(super) names: Option<&'static [&'static str]>,
    pub(super) description: &'static str,
    pub(super) source: Source,
}

impl Feature {
    /// Values of a frame.
    pub(super) fn values(&self) -> usize {
        self.shape.iter().product()
    }
}

type Shape = fn(&Spec) -> Vec<usize>;
type Names = Option<&'static [&'static str]>;
/// Key, type, shape, names, description, which specs have it, source.
type Line = (
    &'static str,
    Scalar,
    Shape,
    Names,
    &'static str,
    fn(&Spec) -> bool,
    Source,
);

const ONE: Shape = |_| vec![1];
const POSE: Shape = |_| vec![POSE_NAMES.len()];
const MAP: Shape = |spec| vec![spec.skin().rows(), spec.skin().cols()];
const WINDOW: Shape = |spec| vec![spec.config().record.measurements];
const MATRIX: Shape = |spec| vec![spec.config().record.measurements, spec.skin().taxels()];

/// Columns of the first object's pose, which name the entries of the state.
const POSE_NAMES: &[&str] = &["x_m", "y_m", "height_m", "rotation_deg", "tilt_x_deg", "tilt_y_deg"];
const MAP_NAMES: Names = Some(&["row", "col"]);

const ALWAYS: fn(&Spec) -> bool = |_| true;

/// Key of the state, which the action takes from the next frame.
pub(super) const STATE: &str = "observation.state";

/// No key contains "image": LeRobot merges the statistics of such keys as those of pictures with colours, and refuses
/// every other shape.
#[rustfmt::skip]
const FEATURES: &[Line] = &[
    (STATE, Scalar::F32, POSE, Some(POSE_NAMES), "pose of the first object on the skin; metres and degrees", ALWAYS,
        Source::Row(|row, out| POSE_NAMES.iter().try_for_each(|name| row.numbers(name, out)))),
    ("observation.tactile.pressure", Scalar::F32, MAP, MAP_NAMES, "true mean pressure over every taxel's cell, Pa",
        |spec| Label::Pressure.is_in(spec),
        Source::Row(|row, out| row.numbers("pressure_pa", out))),
    ("observation.tactile.conductance", Scalar::F32, MAP, MAP_NAMES, "true conductance of every taxel, S",
        |spec| Label::Conductance.is_in(spec),
        Source::Row(|row, out| row.numbers("conductance_s", out))),
    ("observation.tactile.raster", Scalar::F32, MAP, MAP_NAMES, "image as the raster scan of the press has it, V",
        |spec| spec.config().record.raster, Source::Row(|row, out| row.numbers("image_v", out))),
    ("observation.tactile.samples", Scalar::F32, WINDOW, None, "samples of the skin's one wire, V",
        |spec| !spec.config().record.codes, Source::Row(|row, out| row.numbers("y_v", out))),
    ("observation.tactile.samples", Scalar::I64, WINDOW, None, "samples of the skin's one wire, codes of the converter",
        |spec| spec.config().record.codes, Source::Row(|row, out| row.numbers("y_code", out))),
    ("observation.tactile.phi", Scalar::F32, MATRIX, Some(&["measurement", "taxel"]), "rows of the sensing matrix of the samples",
        |spec| spec.config().record.phi, Source::Row(|row, out| row.numbers("phi", out))),
    ("observation.force", Scalar::F32, ONE, None, "normal force on the skin at this frame, N", ALWAYS,
        Source::Row(|row, out| row.numbers("contact_force_n", out))),
    ("action", Scalar::F32, POSE, Some(POSE_NAMES), "`observation.state` of the next frame; of the last frame its own", ALWAYS,
        Source::NextState),
    ("label", Scalar::I64, ONE, None, "class of the first object", ALWAYS, Source::Row(|row, out| row.numbers("label", out))),
    ("source_index", Scalar::I64, ONE, None, "number of the row in the exported data set", ALWAYS,
        Source::Row(|row, out| row.numbers("index", out))),
    ("first_row", Scalar::I64, ONE, None, "row of the sensing matrix of the first sample, counted from the loading of the seeds",
        ALWAYS, Source::Row(|row, out| row.numbers("first_row", out))),
    ("timestamp", Scalar::F32, ONE, None, "time from the first frame of the episode, s", ALWAYS, Source::Timestamp),
    ("frame_index", Scalar::I64, ONE, None, "number of the frame in its episode", ALWAYS, Source::Frame),
    ("episode_index", Scalar::I64, ONE, None, "number of the episode", ALWAYS, Source::Episode),
    ("index", Scalar::I64, ONE, None, "number of the frame", ALWAYS, Source::Index),
    ("task_index", Scalar::I64, ONE, None, "number of the task in meta/tasks.parquet", ALWAYS, Source::Task),
];

/// Features of the frames of `spec`, in their order.
pub(super) fn features(spec: &Spec) -> Vec<Feature> {
    let rows = FEATURES.iter().filter(|(.., has, _)| has(spec));
    rows.map(|(key, scalar, shape, names, description, _, source)| Feature {
        key,
        scalar: *scalar,
        shape: shape(spec),
        names: *names,
        description,
        source: *source,
    })
    .collect()
}
