//! From pressure on the taxels to a recording: transducer, readout and source of weights. The pressure may come from
//! any simulation.

mod cells;
mod config;
mod stages;

pub use cells::{FirmwareCells, RASTER_PERIOD, bus, cell_mode, start_message};
pub use config::{
    ChainConfig, DEFAULT_READOUT, DEFAULT_TRANSDUCER, DEFAULT_WEIGHTS, MAX_TOML_BYTES, ProfileFile, RowsConfig,
    RowsFile, RowsKind, WEIGHT_SOURCES, WeightSource, read_gains,
};
pub use stages::{Acquisition, Chain, ReadoutSession, SkinSession, TaxelSignal, press_facts};
pub(crate) use stages::{of_conductance, of_readout};
