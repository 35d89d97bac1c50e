//! The twin of the single-pixel tactile skin as a library: it simulates scenes, records them, and stores the results.
//!
//! A [`Scene`] says what presses on which skin and how the skin is read out, a [`Twin`] records it, and a [`Session`]
//! holds the recordings, simulated or real. The matrix Φ of a decoder comes from the [`Recording`], whatever its
//! weights are:
//!
//! ```
//! use spts::recon::metrics::{median, pearson};
//! use spts::recon::recover::{NnLasso, Penalty};
//! use spts::recon::{Matrix, Problem, Recover as _, Workspace};
//! use spts::{Mode, Scene, Twin};
//!
//! let session = Twin::new(&Scene::press("T")?)?.record(Mode::Compressive)?;
//! let recorded = session.compressive.as_ref().ok_or("nothing was recorded")?;
//! let recording = &recorded.recording;
//!
//! // 50 measurements of the first press, while it is held, without the output of the untouched skin
//! let window = 50_000..50_050;
//! let volts = &recording.blocks()[0].volts;
//! let idle_v = median(&volts[..15_000]).unwrap_or_default();
//! let y: Vec<f64> = volts[window.clone()].iter().map(|v| v - idle_v).collect();
//! let phi = Matrix::from_rows(50, 100, recording.rows(0, window).to_vec())?;
//!
//! let solver = NnLasso::new(Penalty::Relative(0.02))?;
//! let solution = solver.recover(&Problem::new(phi.view(), &y)?, &mut Workspace::default())?;
//! let mut image = vec![0.0; 100];
//! solution.scatter(&mut image);
//! let truth = recorded.facts(0).and_then(|facts| facts.conductance.as_ref()).ok_or("no truth")?;
//! assert!(pearson(&image, truth.values()) > Some(0.8));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`Scene::from_toml`] takes any skin, object, transducer and readout; [`SceneConfig`](scene::SceneConfig) lists the
//! fields. Another simulator can pass its contact as [`Frame`]s to a [`Chain`], which records them. This needs no
//! MuJoCo: its library is opened when a scene is simulated ([`sim::engine`]). A [`SessionSet`](data::SessionSet) opens
//! folders of sessions and the recordings of the published skin.
//!
//! The crates behind this one are [`contact`], [`models`], [`circuit`], [`firmware`], [`recon`] and [`sim`].

pub mod assign;
pub mod chain;
pub mod cleanup;
pub mod data;
pub mod device;
pub mod output;
pub mod progress;
pub mod provenance;
pub mod record;
pub mod scene;
pub mod session;
pub mod simulate;
mod wire;

pub use chain::{Acquisition, Chain, ChainConfig};
pub use record::Twin;
pub use scene::Scene;
pub use session::{PressFacts, Recorded, Session};
pub use wire::{Pressed, Wire};

pub use spts_circuit::{Block, FrameUnit, Mode, Profile, Recording, RecordingInfo, Seeding, WeightMode, Weights};
pub use spts_contact::{Frame, Pose, Wrench};
pub use spts_input::Refusal;
pub use spts_models::{ConductanceMap, PressureMap, SkinLayout};

pub use spts_circuit as circuit;
pub use spts_contact as contact;
pub use spts_firmware as firmware;
pub use spts_models as models;
pub use spts_recon as recon;
pub use spts_sim as sim;

/// The examples of the README are compiled with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub(crate) struct Readme;

/// The examples of the book's chapter on rows are compiled with the documentation tests.
#[cfg(doctest)]
#[doc = include_str!("../../docs/rows.md")]
pub(crate) struct RowsChapter;
