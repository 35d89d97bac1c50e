//! Touches on a skin, sent through its circuit: common parts of the studies of sensing matrices and of readouts.
//!
//! A [`TouchScene`] defines objects and skin, and [`TouchScene::draw`] presses the objects. A [`TouchWire`] measures
//! the touches through a readout profile with any weights, and a [`TouchScore`] compares an image with the touch.
//!
//! ```
//! use spts_circuit::{Profile, Seeding, WeightMode, Weights};
//! use spts_models::{SkinLayout, Streams};
//! use spts_studies::touches::{TouchObjects, TouchScene, TouchScore, TouchWire};
//!
//! let scene = TouchScene::new(SkinLayout::default(), TouchObjects::Shapes, 3, 1);
//! let touches = scene.draw()?;
//! // one weight for every taxel and measurement, ±1
//! let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 100);
//! let mut wire = TouchWire::new(&Profile::named("ideal")?, &weights, &scene.layout, Streams::new(1))?;
//! let volts = wire.measure(&touches[0], 0, 0, 20)?;
//! assert_eq!(volts.len(), 20);
//! // the image itself shows the touch as it is
//! let score = TouchScore::of(touches[0].conductance_s.values(), &touches[0], &scene.layout);
//! assert_eq!((score.iou, score.place_px), (1.0, Some(0.0)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod scene;
mod score;
mod wire;

pub use scene::{Touch, TouchObjects, TouchScene};
pub use score::{TouchScore, band};
pub use wire::TouchWire;
