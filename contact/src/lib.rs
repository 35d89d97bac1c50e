//! Contact without a physics engine: triangle meshes, and contact fields that compute the pressure on the skin and the
//! wrench on a posed mesh.
//!
//! The skin's free surface is the plane z = 0; the foam lies below it. A *contact field* (a contact model at work, in
//! code `field`) looks at the underside of a body and returns the pressure on a fine grid over the whole skin and the
//! wrench on the body. The squares of that grid, several along each side of a taxel, are called *cells* in names such
//! as `cells_per_taxel`: they have nothing to do with the microcontrollers behind the taxels. Inertia, arms and gravity
//! belong to the simulation that moves the body.
//!
//! ```
//! use spts_contact::{PosedMesh, build_contact, mesh::sphere};
//! use spts_models::SkinLayout;
//!
//! let skin = SkinLayout::default();
//! let mut field = build_contact("winkler", toml::Table::new(), &skin)?;
//! let ball = sphere(33.4e-3, 24, 48); // its lowest point is at z = 0
//! let cell_m = skin.pitch_m() / field.cells_per_taxel() as f64;
//! let answer = field.respond(&PosedMesh::at_rest(&ball, [0.0, 0.0, -2e-3]));
//! let (force_n, sum_pa) = (answer.wrench.force_n[2], answer.pressure_pa.iter().sum::<f64>());
//! assert!(force_n > 1.0 && (sum_pa * cell_m * cell_m - force_n).abs() < 1e-9 * force_n);
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod balance;
mod columns;
mod depth_curve;
mod elastic;
mod envelope;
mod field;
mod foam;
pub mod mesh;
pub mod objects;
mod prepared;
pub mod shapes;
mod support;
mod surface;
mod table;
mod taxels;
mod touch;
mod traction;

pub use columns::WinklerLayer;
pub use depth_curve::DepthCurve;
pub use elastic::{
    ElasticConfig, ElasticField, ElasticKernel, ElasticSolver, Influence, Outcome, confined_stiffness_pa_per_m,
    modulus_of_confined_pa,
};
pub use field::{
    Balance, ContactField, EquilibriumError, Frame, Holder, Load, Patch, Pose, PosedMesh, QuasiStatic, Response, Seat,
    Wrench,
};
pub use foam::Foam;
pub use prepared::PreparedMesh;
pub use support::Support;
pub use surface::{Part, Primitive, Solid, SurfaceField, SurfacePoints, Winding};
pub use table::{CONTACT_FIELDS, ContactBuild, ContactTable, build_contact, build_contact_from};
pub use taxels::TaxelBins;
pub use touch::{Carried, TouchBody, TouchSkin};
