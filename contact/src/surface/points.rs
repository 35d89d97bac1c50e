//! Sample points of a skin.

use spts_models::{ConfigError, SkinLayout, in_range};

/// Sample points of a skin's free surface. Each has its outward normal, its area, and its taxel.
///
/// Lengths are in metres, in the skin's own axes.
///
/// ```
/// use spts_contact::SurfacePoints;
/// use spts_models::SkinLayout;
///
/// let points = SurfacePoints::flat(&SkinLayout::default(), 4)?;
/// assert_eq!((points.len(), points.taxels()), (1600, 100));
/// let (centre_m, normal) = points.taxel_centres()[0];
/// assert!((centre_m[0] + 67.5e-3).abs() < 1e-12 && (centre_m[1] - 67.5e-3).abs() < 1e-12);
/// assert_eq!(normal, [0.0, 0.0, 1.0]);
/// # Ok::<(), spts_models::ConfigError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePoints {
    pub(super) positions_m: Vec<[f64; 3]>,
    pub(super) normals: Vec<[f64; 3]>,
    pub(super) areas_m2: Vec<f64>,
    pub(super) taxels: Vec<u32>,
    /// Area of every taxel, m²: the sum over its points.
    taxel_areas_m2: Vec<f64>,
}

/// Most sample points of a skin.
const MOST_POINTS: usize = 1 << 24;

impl SurfacePoints {
    /// Points at `positions_m` with `normals` of any length but 0. Point i belongs to taxel `taxels[i]`; every taxel up
    /// to the largest number must have a point.
    ///
    /// # Errors
    /// [`ConfigError`] for the first number that is not finite, normal of length 0, area that is not positive, list of
    /// another length, or taxel without a point.
    pub fn new(
        positions_m: Vec<[f64; 3]>,
        normals: Vec<[f64; 3]>,
        areas_m2: Vec<f64>,
        taxels: Vec<u32>,
    ) -> Result<Self, ConfigError> {
        let count = positions_m.len();
        in_range("points", count as f64, (1..=MOST_POINTS).contains(&count), "[1, 2^24]")?;
        for (field, found) in [
            ("normals", normals.len()),
            ("areas_m2", areas_m2.len()),
            ("taxels", taxels.len()),
        ] {
            in_range(field, found as f64, found == count, "as many as there are points")?;
        }
        for (i, p) in positions_m.iter().enumerate() {
            for v in p {
                in_range(&format!("positions_m[{i}]"), *v, v.abs() <= 1e3, "[-1000, 1000] m")?;
            }
        }
        let mut units = normals;
        for (i, n) in units.iter_mut().enumerate() {
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            let valid = length.is_finite() && length > 1e-12;
            in_range(&format!("normals[{i}]"), length, valid, "of a length above 1e-12")?;
            *n = n.map(|v| v / length);
        }
        for (i, area) in areas_m2.iter().enumerate() {
            in_range(
                &format!("areas_m2[{i}]"),
                *area,
                *area > 0.0 && *area <= 1.0,
                "(0, 1] m²",
            )?;
        }
        let taxel_count = taxels.iter().copied().max().map_or(0, |k| k as usize + 1);
        in_range(
            "taxels",
            taxel_count as f64,
            taxel_count <= count,
            "numbers below that of the points",
        )?;
        let mut taxel_areas_m2 = vec![0.0; taxel_count];
        for (taxel, area) in taxels.iter().zip(&areas_m2) {
            taxel_areas_m2[*taxel as usize] += area;
        }
        if let Some(k) = taxel_areas_m2.iter().position(|area| *area <= 0.0) {
            in_range("taxels", k as f64, false, "a point for every taxel up to the last one")?;
        }
        Ok(Self {
            positions_m,
            normals: units,
            areas_m2,
            taxels,
            taxel_areas_m2,
        })
    }

    /// A flat skin with `cells_per_taxel` × `cells_per_taxel` points a taxel, in the plane z = 0 and centred on the
    /// origin. Rows run from the largest y to the smallest, columns from the smallest x to the largest.
    ///
    /// # Errors
    /// [`ConfigError`] for no points, or too many.
    pub fn flat(skin: &SkinLayout, cells_per_taxel: usize) -> Result<Self, ConfigError> {
        let [rows, cols] = [skin.rows(), skin.cols()].map(|n| n.saturating_mul(cells_per_taxel));
        let count = rows.saturating_mul(cols);
        let valid = (1..=MOST_POINTS).contains(&count);
        in_range("rows × cols × cells_per_taxel²", count as f64, valid, "[1, 2^24]")?;
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let at = |i: usize, n: usize| (i as f64 + 0.5 - 0.5 * n as f64) * cell_m;
        let (mut positions_m, mut taxels) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for row in 0..rows {
            for col in 0..cols {
                positions_m.push([at(col, cols), -at(row, rows), 0.0]);
                let taxel = row / cells_per_taxel * skin.cols() + col / cells_per_taxel;
                taxels.push(u32::try_from(taxel).unwrap_or(u32::MAX));
            }
        }
        Self::new(
            positions_m,
            vec![[0.0, 0.0, 1.0]; count],
            vec![cell_m * cell_m; count],
            taxels,
        )
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions_m.len()
    }

    /// Always `false`: there is at least one point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions_m.is_empty()
    }

    /// Number of taxels.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxel_areas_m2.len()
    }

    /// Position of every point, m.
    #[must_use]
    pub fn positions_m(&self) -> &[[f64; 3]] {
        &self.positions_m
    }

    /// Outward unit normal at every point.
    #[must_use]
    pub fn normals(&self) -> &[[f64; 3]] {
        &self.normals
    }

    /// Area of every point, m².
    #[must_use]
    pub fn areas_m2(&self) -> &[f64] {
        &self.areas_m2
    }

    /// Taxel of every point.
    #[must_use]
    pub fn taxel_of(&self) -> &[u32] {
        &self.taxels
    }

    /// Area of every taxel, m².
    #[must_use]
    pub fn taxel_areas_m2(&self) -> &[f64] {
        &self.taxel_areas_m2
    }

    /// Centre of every taxel, m, and its mean normal, of length 1 unless the normals of its points cancel.
    #[must_use]
    pub fn taxel_centres(&self) -> Vec<([f64; 3], [f64; 3])> {
        let mut sums = vec![([0.0; 3], [0.0; 3]); self.taxels()];
        for (i, taxel) in self.taxels.iter().enumerate() {
            let (place, normal) = &mut sums[*taxel as usize];
            for k in 0..3 {
                place[k] += self.areas_m2[i] * self.positions_m[i][k];
                normal[k] += self.areas_m2[i] * self.normals[i][k];
            }
        }
        for ((place, normal), area) in sums.iter_mut().zip(&self.taxel_areas_m2) {
            let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            *place = place.map(|v| v / area);
            *normal = normal.map(|v| v / length);
        }
        sums
    }

    /// Averages `values`, one a point, over the area of every taxel into `means`.
    ///
    /// # Panics
    /// If the number of values differs from that of the points, or that of means from the taxels.
    pub fn means(&self, values: &[f64], means: &mut [f64]) {
        assert_eq!((values.len(), means.len()), (self.len(), self.taxels()));
        means.fill(0.0);
        for ((value, area), taxel) in values.iter().zip(&self.areas_m2).zip(&self.taxels) {
            means[*taxel as usize] += value * area;
        }
        for (mean, area) in means.iter_mut().zip(&self.taxel_areas_m2) {
            *mean /= area;
        }
    }
}
