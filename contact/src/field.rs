//! Interface of contact fields.

use crate::body::PosedMesh;
use crate::prepared::PreparedMesh;
use crate::quasi_static::QuasiStatic;
use crate::response::Response;

/// Elastic layer of the skin in contact with a body.
pub trait ContactField: Send {
    /// Pressure on the skin and wrench on the body for the given pose and velocity.
    ///
    /// The normal force of the wrench equals the sum of pressure × cell area; pressure is finite and never negative,
    /// at any depth and for any mesh whose vertices are finite and whose triangles name vertices that exist.
    ///
    /// A wrench of NaN means that there is no answer, and the pressure then means nothing: pose or velocity are not
    /// finite, or the field's own solver gave up. A world stops with an error.
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_>;

    /// Makes `mesh` the one that bodies are expected to have. It changes no answer: a body with this very
    /// mesh needs no comparison, and what was prepared once is not made again.
    fn expect(&mut self, _mesh: &PreparedMesh) {}

    /// Puts the layer under preload: `strain` is the compression of the foam under every taxel, row by row, as a share
    /// of its thickness, while nothing touches the skin; each in [0, 1). Returns the pressure of every taxel then, Pa.
    /// `None`, and nothing is changed, for a field without preloads.
    ///
    /// Answers are what a body adds: it meets the surface at the same height, on foam that is stiffer by its
    /// compression, and an electrode feels the answer and the preload. A preload of 0 changes no answer.
    ///
    /// # Panics
    /// When there is not one strain a taxel.
    fn preload(&mut self, _strain: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Why the last answer was none, when the field can say.
    fn failure(&self) -> Option<String> {
        None
    }

    /// Pressure that a frame shows, Pa, shaped as in [`Response`], when the field sees more than it answered to the
    /// dynamics; `None` when the answer is all there is, or when there is none: then [`ContactField::failure`] says
    /// why, and a world stops with an error. It carries the same normal force `force_n`.
    ///
    /// Called after [`ContactField::respond`] with the same body, for frames only.
    fn refine(&mut self, _body: &PosedMesh<'_>, _force_n: f64) -> Option<&[f64]> {
        None
    }

    /// The field as one that finds the pose under a prescribed force itself, when it is one: its presses need no
    /// dynamics.
    fn quasi_static(&mut self) -> Option<&mut dyn QuasiStatic> {
        None
    }

    /// Relative accuracy of an answer, of which earlier poses may take a part (an iteration that starts from the last
    /// pressure); 0 when the answer is a function of the body alone, bit for bit.
    fn tolerance(&self) -> f64 {
        0.0
    }

    /// Fine cells along one side of a taxel.
    fn cells_per_taxel(&self) -> usize;

    /// Every parameter, defaults included, as it would be written in a scene: enough to build the same field again.
    fn parameters(&self) -> toml::Table;

    /// Damping time of the layer, s: the viscous part of the pressure is this time × the rate of the elastic part.
    /// Bounds the time step together with the stiffness. 0 for an answer that no speed changes.
    fn damping_s(&self) -> f64 {
        0.0
    }

    /// Thickness of the layer, m.
    fn thickness_m(&self) -> f64;
}
