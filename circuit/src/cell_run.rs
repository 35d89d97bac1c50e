//! One cell over consecutive measurements.

/// One cell over consecutive measurements, as modified by its faults.
#[derive(Debug)]
pub struct CellRun<'a> {
    /// Row of the weight matrix at the first entry; the other entries use the following rows.
    pub first_row: u64,
    /// Time from one measurement to the next, s.
    pub period_s: f64,
    /// Drive level, −1 to 1.
    pub levels: &'a mut [f64],
    /// Factor on the taxel's contribution; 1 for a fault-free cell.
    pub gains: &'a mut [f64],
}

impl CellRun<'_> {
    /// Rows with level and gain of each.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (u64, &mut f64, &mut f64)> {
        let rows = self.first_row..;
        let values = self.levels.iter_mut().zip(&mut *self.gains);
        rows.zip(values).map(|(row, (level, gain))| (row, level, gain))
    }
}
