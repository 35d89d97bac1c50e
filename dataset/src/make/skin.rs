//! The skin of a row: specimen, session, faults and readouts.

use super::error::RowCause;
use crate::spec::{Spec, whole};
use rand::RngExt as _;
use rand::seq::{IndexedRandom as _, index::sample};
use spts::Chain;
use spts::chain::SkinSession;
use spts_circuit::{FAULTS, Mode, Readout};

/// Bits of a specimen's seed, so that a double holds it.
const SEED_BITS: u32 = 53;

/// Skin number `number` of a data set, in one session.
pub(crate) struct Skin {
    pub(crate) number: u64,
    /// Seed of the specimen.
    pub(crate) seed: u64,
    /// The skin before the first press.
    pub(crate) fresh: SkinSession,
    pub(crate) compressive: Readout,
    pub(crate) raster: Readout,
    /// Largest output of the amplifier in each mode, V: compressive, raster.
    pub(crate) rails_v: [Option<f64>; 2],
    /// Number of faulty cells.
    pub(crate) faults: usize,
}

impl Skin {
    pub(crate) fn new(spec: &Spec, number: u64) -> Result<Self, RowCause> {
        let streams = spec.streams();
        let seed = match &spec.config().skin.seed {
            Some(seed) => whole(seed.value(streams, "skin.seed", number)) as u64,
            None => streams.rng("skin.seed", number).random::<u64>() >> (u64::BITS - SEED_BITS),
        };
        let faults = faults(spec, number);
        let chain = Chain::new(&spec.chain_config(number, &faults)?, spec.skin(), seed, spec.folder())?;
        let rail_v = |mode| chain.profile().rail_v(mode).map_err(|error| error.at("readout"));
        Ok(Self {
            number,
            seed,
            fresh: chain.skin_session(number),
            compressive: chain.readout(Mode::Compressive, number)?,
            raster: chain.readout(Mode::Raster, number)?,
            rails_v: [rail_v(Mode::Compressive)?, rail_v(Mode::Raster)?],
            faults: faults.len(),
        })
    }
}

/// The faulty cells of skin `number`, each another one.
fn faults(spec: &Spec, number: u64) -> Vec<toml::Table> {
    let (config, streams) = (&spec.config().faults, spec.streams());
    let count = whole(config.count.value(streams, "faults.count", number));
    if count == 0 {
        return Vec::new();
    }
    let mut rng = streams.rng("faults", number);
    let mut taxels = sample(&mut rng, spec.skin().taxels(), count).into_vec();
    taxels.sort_unstable();
    let all: Vec<&str> = match &config.names {
        Some(names) => names.iter().map(String::as_str).collect(),
        None => FAULTS.iter().map(|(name, _)| *name).collect(),
    };
    let fault = |taxel: usize| {
        let name = all.choose(&mut rng).copied().unwrap_or_default();
        let taxel = i64::try_from(taxel).unwrap_or(i64::MAX);
        [("name".to_owned(), name.into()), ("taxel".to_owned(), taxel.into())]
            .into_iter()
            .collect()
    };
    taxels.into_iter().map(fault).collect()
}
