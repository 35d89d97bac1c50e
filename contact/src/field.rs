//! Interface of contact fields: what computes the pressure between a body and the skin.

use crate::body::PosedMesh;
use crate::prepared::PreparedMesh;
use crate::quasi_static::QuasiStatic;
use crate::response::Response;

/// A contact model at work: the skin's foam, which answers a posed body with the pressure on the skin and the wrench on
/// the body.
///
/// ```
/// use spts_contact::{PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut field = build_contact("winkler", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let mut force_n = |depth_m: f64| field.respond(&PosedMesh::at_rest(&block, [0.0, 0.0, -depth_m])).wrench.force_n[2];
/// assert_eq!(force_n(0.0), 0.0);
/// assert!(force_n(1e-3) > 2.0 * force_n(0.5e-3), "the foam densifies");
/// # Ok::<(), spts_contact::ContactError>(())
/// ```
pub trait ContactField: Send {
    /// Pressure on the skin and wrench on the body for the given pose and velocity.
    ///
    /// The normal force of the wrench equals the sum of pressure × area over all grid squares. Pressure is finite and
    /// never negative, at any depth and for any mesh with finite vertices and valid indices.
    ///
    /// A wrench of NaN means that there is no answer: pose or velocity is not finite, or a solver failed. The pressure
    /// then has no meaning, and a simulation stops with an error.
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_>;

    /// Announces the mesh of the following bodies, so that it is prepared once and not compared at each call. It
    /// changes no answer.
    fn expect(&mut self, _mesh: &PreparedMesh) {}

    /// Sets a preload: `strain` is the compression of the foam under every taxel while nothing touches the skin, as a
    /// share of its thickness, in [0, 1) and in row-major order. Returns the resulting pressure of every taxel, Pa;
    /// `None`, and nothing changes, for a contact model without preloads.
    ///
    /// Answers are the addition due to the body: it meets the surface at the same height, on foam that its compression
    /// has made stiffer. An electrode is under the answer plus the preload. A preload of 0 changes no answer.
    ///
    /// # Panics
    /// If the number of strains differs from that of the taxels.
    fn preload(&mut self, _strain: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Why the last call had no answer; `None` if it had one, or if the reason is not known.
    fn failure(&self) -> Option<String> {
        None
    }

    /// Pressure for a frame, Pa, with the shape of that in [`Response`], if it is more accurate than the answer for the
    /// dynamics. It has the same normal force `force_n`. `None` if the answer itself is the best, or if there is none:
    /// then [`ContactField::failure`] gives the reason, and a simulation stops with an error.
    ///
    /// Called after [`ContactField::respond`] with the same body, for frames only.
    fn refine(&mut self, _body: &PosedMesh<'_>, _force_n: f64) -> Option<&[f64]> {
        None
    }

    /// The same contact field as one that finds the pose under a prescribed force, so that a press needs no dynamics;
    /// `None` for a contact model that cannot.
    fn quasi_static(&mut self) -> Option<&mut dyn QuasiStatic> {
        None
    }

    /// Relative accuracy of an answer whose iteration starts from the last pressure, so that earlier poses affect it. 0
    /// if the answer depends only on the body, bit for bit.
    fn tolerance(&self) -> f64 {
        0.0
    }

    /// Grid squares along one side of a taxel: the resolution of the pressure.
    fn cells_per_taxel(&self) -> usize;

    /// All parameters, defaults included, as a scene would write them. They are enough to build the same contact field
    /// again.
    fn parameters(&self) -> toml::Table;

    /// Damping time of the layer, s: the viscous part of the pressure is this time × the rate of the elastic part.
    /// Together with the stiffness it limits the time step. 0 if answers do not depend on speed.
    fn damping_s(&self) -> f64 {
        0.0
    }

    /// Thickness of the layer, m.
    fn thickness_m(&self) -> f64;
}
