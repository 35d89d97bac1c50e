//! Parts of a body beyond the edge of the sheet.

use super::{Mechanics, Task};

/// How far the part of a body that can touch the skin extends beyond each edge of the sheet, m; 0 if it does not.
///
/// ```
/// use spts_sim::Mechanics;
///
/// let middle = Mechanics::from_toml("[press]\nobject = \"tape\"\nrow = 4.5\ncol = 4.5", ".".as_ref())?;
/// assert!(middle.overhang().is_none());
/// let beside = Mechanics::from_toml("[press]\nobject = \"tape\"\nrow = 0.0\ncol = 4.5", ".".as_ref())?;
/// assert!(beside.overhang().expect("reaches over the edge").first_row_m > 1e-3);
/// # Ok::<(), spts_sim::mechanics::MechanicsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overhang {
    /// Beyond the edge at row 0.
    pub first_row_m: f64,
    /// Beyond the edge at the last row.
    pub last_row_m: f64,
    /// Beyond the edge at column 0.
    pub first_col_m: f64,
    /// Beyond the edge at the last column.
    pub last_col_m: f64,
}

/// An overhang that is not worth a word, m.
const NEGLIGIBLE_M: f64 = 1e-4;

impl Overhang {
    /// The largest of the four, m.
    #[must_use]
    pub fn largest_m(&self) -> f64 {
        self.edges().into_iter().map(|(_, m)| m).fold(0.0, f64::max)
    }

    /// The edges by name, with the overhang over each, m.
    #[must_use]
    pub fn edges(&self) -> [(&'static str, f64); 4] {
        [
            ("row 0", self.first_row_m),
            ("the last row", self.last_row_m),
            ("column 0", self.first_col_m),
            ("the last column", self.last_col_m),
        ]
    }
}

impl Mechanics {
    /// Overhang of the part of the body that is below the free surface at the target force, or at the deepest point of
    /// a drop; `None` if it is less than 0.1 mm. The scatter of presses is not included.
    #[must_use]
    pub fn overhang(&self) -> Option<Overhang> {
        let (body, _) = self.contact_body();
        let depth_m = match self.task() {
            Task::Press(press) => self.depth_curve().depth_m(press.force_n),
            Task::Drop(_) => self.depth_curve().depth_m(f64::INFINITY),
        };
        let [low_m, _] = body.heights_m();
        let top_m = low_m + depth_m;
        let turned: Vec<[f64; 3]> = body.mesh.vertices.iter().map(|v| rotated(&body.rotation, v)).collect();
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut reach = |[x, y]: [f64; 2]| {
            for (axis, at) in [x, y].into_iter().enumerate() {
                least[axis] = least[axis].min(at);
                most[axis] = most[axis].max(at);
            }
        };
        for triangle in &body.mesh.triangles {
            let corners = triangle.map(|k| turned[k as usize]);
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if a[2] <= top_m {
                    reach([a[0], a[1]]);
                }
                if (a[2] <= top_m) != (b[2] <= top_m) {
                    let s = (top_m - a[2]) / (b[2] - a[2]);
                    reach([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
                }
            }
        }
        let [width_m, height_m] = self.skin().extent_m();
        let [x, y, _] = body.position_m;
        let over = |beyond_m: f64| beyond_m.max(0.0);
        let overhang = Overhang {
            first_row_m: over(y + most[1] - 0.5 * height_m),
            last_row_m: over(-(y + least[1]) - 0.5 * height_m),
            first_col_m: over(-(x + least[0]) - 0.5 * width_m),
            last_col_m: over(x + most[0] - 0.5 * width_m),
        };
        (overhang.largest_m() > NEGLIGIBLE_M).then_some(overhang)
    }
}

fn rotated(rotation: &[[f64; 3]; 3], v: &[f64; 3]) -> [f64; 3] {
    rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}
