//! The twin as a recording device: scenes in, recordings of the same type as the published ones out.

mod cells;
mod error;
mod facts;
mod press;
mod record;
mod stages;
mod weights;

pub use cells::{CellsError, FirmwareCells};
pub use cells::{RASTER_PERIOD, bus, cell_mode};
pub use error::TwinError;
pub use facts::{hold_s, press_facts};
pub use press::{PressFrames, press_frames};
pub use record::{RecordedSession, bounce_session, press_session, recorded, recorded_from};
pub use stages::{Chain, DEFAULT_READOUT, DEFAULT_TRANSDUCER, Take};
pub use weights::{DEFAULT_WEIGHTS, WEIGHT_SOURCES, WeightSource};
