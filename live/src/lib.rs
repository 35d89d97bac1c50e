//! `spts live`: a page on this machine on which an object is pressed on the skin by hand, while its one wire and the
//! images of two decoders are shown.
//!
//! A [`LiveSession`] is one skin and what presses it: requests go in, [`step`](LiveSession::step) answers with what is
//! shown. It knows no network. A [`Server`] gives every page that is opened a session of its own. Contact alone: there
//! is no physics engine.
//!
//! ```
//! use spts_live::{LiveSession, Request, Shelf};
//! use std::sync::Arc;
//!
//! let mut session = LiveSession::new(Arc::new(Shelf::new()), 7, "T")?;
//! session.apply(Request::Press { x_mm: 0.0, y_mm: 0.0, force_n: 20.0 })?;
//! for _ in 0..40 {
//!     session.step()?;
//! }
//! let shown = session.step()?;
//! assert!(shown.force_n > 19.0 && shown.pressure_kpa.iter().sum::<f64>() > 50.0);
//! # Ok::<(), spts::Refusal>(())
//! ```

mod connections;
mod object;
mod presser;
mod server;
mod session;
mod settings;
mod wires;

pub use object::{LiveObject, MeshUnit, Shape, Side, UploadedMesh};
pub use server::{LiveConfig, Server, token};
pub use session::{Frame, LineFrame, LiveSession, PanelFrame, Request};
pub use settings::{FORCE_N, MEASUREMENTS, NOISE_FACTOR};
pub use wires::Shelf;

/// Time between two updates, s, on the skin and for whoever looks at it.
pub const UPDATE_S: f64 = 0.025;
