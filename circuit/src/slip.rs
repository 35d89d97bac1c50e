//! Measurements that lag behind their rows, and how recordings are realigned.

use crate::recording::{Block, Recording};
use serde::{Deserialize, Serialize};

/// From measurement `from` of a block on, the cells are `rows` clock edges behind the count of measurements:
/// measurement i has the row that belongs to measurement i − `rows`. This holds until the next slip of the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slip {
    /// Block of the recording, from 0.
    pub block: usize,
    /// First measurement of the block that lags.
    pub from: usize,
    /// Total number of rows by which the measurements lag; negative if the cells are ahead.
    pub rows: i64,
}

impl Recording {
    /// The same recording with every sample moved to the row with which it was taken, so that [`Recording::rows`] is
    /// correct again. Positions without a sample are marked as lost (NaN). If edges were missed within a block, the
    /// cells repeated some rows; the first sample of such a row is kept. Samples that move out of their block are
    /// dropped. `slips` must be in order of block and measurement.
    ///
    /// ```
    /// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, Slip, WeightMode, Weights};
    /// use spts_models::SkinLayout;
    ///
    /// let layout = SkinLayout::new(1, 2, 5e-3, 3e-3)?;
    /// let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 2), 64_300.0);
    /// let block = Block { frame_position: 9, idle_frames: None, volts: vec![0.0, 1.0, 1.5, 2.0, 3.0, 4.0] };
    /// let recording = Recording::new(info, vec![block])?;
    /// // one edge was missed before the third measurement
    /// let aligned = recording.realigned(&[Slip { block: 0, from: 2, rows: 1 }]);
    /// assert_eq!(aligned.blocks()[0].volts[..5], [0.0, 1.0, 2.0, 3.0, 4.0]);
    /// assert!(aligned.blocks()[0].volts[5].is_nan());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn realigned(&self, slips: &[Slip]) -> Self {
        let mut blocks = self.blocks().to_vec();
        for (number, block) in blocks.iter_mut().enumerate() {
            let of_block: Vec<&Slip> = slips.iter().filter(|slip| slip.block == number).collect();
            if !of_block.is_empty() {
                put_back(block, &of_block);
            }
        }
        self.with_samples_of(blocks)
    }
}

fn put_back(block: &mut Block, slips: &[&Slip]) {
    let len = block.volts.len();
    let mut volts = vec![f64::NAN; len];
    let mut taken = vec![false; len];
    for (i, &sample) in block.volts.iter().enumerate() {
        let rows = slips.iter().rfind(|slip| slip.from <= i).map_or(0, |slip| slip.rows);
        let place = i64::try_from(i).ok().and_then(|i| i.checked_sub(rows));
        let place = place.and_then(|place| usize::try_from(place).ok());
        if let Some(place) = place.filter(|&place| place < len && !taken[place]) {
            volts[place] = sample;
            taken[place] = true;
        }
    }
    block.volts = volts;
}
