//! Tasks of cells.

use serde::{Serialize, Serializer};
use spts_circuit::{Patterns, Seeding, WeightMode, Weights, WeightsError};

/// How cells are started. As text: its `mode`, and for a pattern also its `period`.
///
/// ```
/// use spts_studies::firmware::CellTask;
///
/// assert_eq!(CellTask::Pattern(20).period(), Some(20));
/// assert_eq!(CellTask::ALL[0].mode(), "raster");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellTask {
    /// With seeds, in a mode of the generator or the raster.
    Mode(WeightMode),
    /// With patterns of this number of bits, in [1, 64]: the first outputs of cells with mixed seeds.
    Pattern(usize),
}

impl CellTask {
    /// All modes, in the order of their bytes, and patterns of three lengths.
    pub const ALL: [Self; 6] = [
        Self::Mode(WeightMode::Raster),
        Self::Mode(WeightMode::Analog),
        Self::Mode(WeightMode::Binary),
        Self::Pattern(7),
        Self::Pattern(20),
        Self::Pattern(64),
    ];
    /// One of each kind.
    pub const KINDS: [Self; 4] = [Self::ALL[0], Self::ALL[1], Self::ALL[2], Self::ALL[4]];

    /// Name of the mode.
    #[must_use]
    pub fn mode(self) -> &'static str {
        match self {
            Self::Mode(mode) => mode.name(),
            Self::Pattern(_) => "pattern",
        }
    }

    /// Number of bits of the pattern; `None` for other modes.
    #[must_use]
    pub fn period(self) -> Option<usize> {
        match self {
            Self::Mode(_) => None,
            Self::Pattern(period) => Some(period),
        }
    }

    /// Name of the mode, with the number of bits for a pattern.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Mode(mode) => mode.name().to_owned(),
            Self::Pattern(period) => format!("pattern {period}"),
        }
    }

    /// Mode that the codes are levels of.
    pub(super) fn levels(self) -> WeightMode {
        match self {
            Self::Mode(mode) => mode,
            Self::Pattern(_) => WeightMode::Binary,
        }
    }

    /// The twin's weights of `cells` cells that are started with this.
    pub(super) fn weights(self, seeding: Seeding, cells: usize) -> Result<Weights, WeightsError> {
        let taxels = u32::try_from(cells).unwrap_or(u32::MAX);
        match self {
            Self::Mode(mode) => Ok(Weights::new(mode, seeding, taxels)),
            Self::Pattern(period) => {
                let mut codes = vec![0; period * cells];
                Weights::new(WeightMode::Binary, Seeding::Mixed, taxels).fill_codes(0, &mut codes);
                Weights::with_patterns(WeightMode::Binary, Patterns::new(period, codes)?)
            }
        }
    }
}

impl Serialize for CellTask {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Text {
            mode: &'static str,
            #[serde(skip_serializing_if = "Option::is_none")]
            period: Option<usize>,
        }
        let (mode, period) = (self.mode(), self.period());
        Text { mode, period }.serialize(serializer)
    }
}
