//! The elastic half-space and the bonded elastic layer as contact fields.

use super::config::ElasticConfig;
use super::skin::ElasticSkin;
use crate::body::PosedMesh;
use crate::columns::WinklerLayer;
use crate::field::ContactField;
use crate::prepared::PreparedMesh;
use crate::response::Response;
use spts_models::{ConfigError, SkinLayout};

/// Linear elastic skin (bonded layer or half-space) under the mesh's lower envelope, with damping, densification and
/// friction.
///
/// Contact without adhesion: p ≥ 0, and where p > 0 the surface follows the body, C p = δ + τ δ′. Damping of the
/// Kelvin–Voigt material is proportional to its elasticity, so the same kernel C describes both terms. This is exact
/// while the contact set does not change; the retarded motion of the free surface is neglected. A body with the surface
/// stiffness K_b yields by a further p/K_b at each cell.
///
/// Densification: the linear problem gives q; the pressure is p = f(q (1/K + 1/K_b)) with the foam law f of `winkler`.
/// This is exact for uniform pressure and for small strain. In between, the contact area is that of the linear problem,
/// and each cell stiffens by its own load. The approximation is good if lateral coupling is weak (ν ≤ 0.3, patches
/// wider than h).
///
/// The surface beside a load rises if ν exceeds about 0.2. Contact outside the geometric overlap is then searched down
/// to [`Influence::bulge`] × the depth, the rise beside a half-plane under uniform pressure.
///
/// If a pose or velocity is not finite, or the iteration does not converge, there is no answer: the pressure is 0 and
/// the wrench NaN, which stops the simulation. Without `coupled`, the same holds for a frame whose iteration fails. At
/// first touch, where the force of a moving body jumps from cell to cell, such a frame may instead have the pressure of
/// the dynamics.
///
/// Validity: small slopes; for the half-space, contact that is narrow compared with the thickness; the normal problem
/// neglects friction.
///
/// [`Influence::bulge`]: super::Influence::bulge
///
/// ```
/// use spts_contact::{PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut layer = build_contact("layer", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let answer = layer.respond(&PosedMesh::at_rest(&block, [0.0, 0.0, -0.5e-3]));
/// let cells = answer.pressure_pa.len().isqrt();
/// let row = &answer.pressure_pa[cells * cells / 2..][..cells];
/// let highest_pa = row.iter().copied().fold(0.0, f64::max);
/// assert!(highest_pa > 1.05 * row[cells / 2], "an elastic layer is pressed most at the edges of a flat punch");
/// # Ok::<(), spts_contact::ContactError>(())
/// ```
pub struct ElasticField {
    config: ElasticConfig,
    skin: ElasticSkin,
    /// The layer used by the dynamics without `coupled`.
    winkler: Option<WinklerLayer>,
}

/// Error of an answer in units of the tolerance: the estimate of the error may be low by 2–3 near sharp edges, and
/// densification raises relative errors by up to 4 (slope × depth / pressure of the foam's law at its knee).
const ERROR_PER_TOLERANCE: f64 = 10.0;

impl ElasticField {
    /// A bonded layer (if `bonded`) or a half-space under `skin`.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range, or the skin has more than 2²⁰ grid squares.
    pub fn new(mut config: ElasticConfig, bonded: bool, skin: &SkinLayout) -> Result<Self, ConfigError> {
        config.check(bonded, skin)?;
        config.densification.get_or_insert(bonded);
        let winkler = if config.coupled {
            None
        } else {
            Some(WinklerLayer::new(config.winkler(), skin)?)
        };
        Ok(Self {
            skin: ElasticSkin::new(config, bonded, skin),
            winkler,
            config,
        })
    }
}

impl ContactField for ElasticField {
    fn expect(&mut self, mesh: &PreparedMesh) {
        self.skin.expect(mesh);
        if let Some(winkler) = &mut self.winkler {
            winkler.expect(mesh);
        }
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        match &mut self.winkler {
            // a frame's pressure may reach further than the dynamics' own
            Some(winkler) => Response {
                patch: None,
                ..winkler.respond(body)
            },
            None => self.skin.respond(body),
        }
    }

    fn failure(&self) -> Option<String> {
        self.skin.failure().map(|failure| failure.to_string())
    }

    fn refine(&mut self, body: &PosedMesh<'_>, force_n: f64) -> Option<&[f64]> {
        self.winkler.as_ref()?;
        self.skin.carry(body, force_n)
    }

    fn tolerance(&self) -> f64 {
        if self.config.coupled {
            ERROR_PER_TOLERANCE * self.config.tolerance
        } else {
            0.0
        }
    }

    fn cells_per_taxel(&self) -> usize {
        self.config.cells_per_taxel
    }

    fn parameters(&self) -> toml::Table {
        // a struct of plain numbers always serialises to a table
        toml::Table::try_from(self.config).unwrap_or_default()
    }

    fn damping_s(&self) -> f64 {
        self.config.damping_s
    }

    fn thickness_m(&self) -> f64 {
        self.config.thickness_m
    }
}
