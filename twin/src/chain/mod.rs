//! From pressure on the taxels to a recording: transducer, readout and source of weights. The pressure may come from
//! any simulation.

mod acquisition;
mod cells;
mod config;
mod error;
mod facts;
mod gains;
mod pieces;
mod rows;
mod signal;
mod stages;
mod weights;

pub use acquisition::Acquisition;
pub use cells::{CellsError, FirmwareCells};
pub use cells::{RASTER_PERIOD, bus, cell_mode, start_message};
pub use config::{ChainConfig, DEFAULT_READOUT, DEFAULT_TRANSDUCER};
pub use error::ChainError;
pub use facts::press_facts;
pub use gains::read_gains;
pub use pieces::{ReadoutSession, SkinSession};
pub use rows::{RowsConfig, RowsFile, RowsKind};
pub use signal::TaxelSignal;
pub use stages::{Chain, MAX_TOML_BYTES, ProfileFile};
pub use weights::{DEFAULT_WEIGHTS, WEIGHT_SOURCES, WeightSource};
