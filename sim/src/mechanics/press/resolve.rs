//! Fills what depends on the object, and checks a press.

use super::PressConfig;
use crate::mechanics::error::{MAX_LIDDED_TILT_DEG, MechanicsError};
use crate::mechanics::place::{Place, check as check_place, of_published};
use spts_contact::PreparedMesh;
use spts_contact::mesh::{MeshReport, load};
use spts_contact::objects::{Placement, pressable};
use spts_models::{ConfigError, SkinLayout, in_range};
use std::path::Path;

/// Largest scale of a mesh: a file in kilometres.
const MAX_SCALE: f64 = 1e3;

impl PressConfig {
    /// Fills what depends on the object, checks every value and loads the mesh, unless it is `given`; with the report
    /// on a mesh from a file.
    pub(in crate::mechanics) fn resolve(
        &mut self,
        skin: &SkinLayout,
        folder: &Path,
        given: Option<PreparedMesh>,
    ) -> Result<(PreparedMesh, Option<MeshReport>), MechanicsError> {
        if let Some(scale) = self.scale {
            in_range("press.scale", scale, scale > 0.0 && scale <= MAX_SCALE, "(0, 1000]")?;
        }
        let (mesh, report, place) = match (&self.object, &self.mesh, given) {
            (None, None, Some(mesh)) => (mesh, None, middle(skin)),
            (Some(name), None, None) => {
                if self.scale.is_some() {
                    return Err(MechanicsError::ScaledObject { name: name.clone() });
                }
                let Some(object) = pressable().find(|object| object.name == name) else {
                    let known: Vec<_> = pressable().map(|object| object.name).collect();
                    return Err(MechanicsError::UnknownObject {
                        name: name.clone(),
                        known: known.join(", "),
                    });
                };
                self.stiffness_pa_per_m = self.stiffness_pa_per_m.or(object.stiffness_pa_per_m);
                let [row, col] = of_published([object.placement.row, object.placement.col], skin);
                let placement = Placement {
                    row,
                    col,
                    ..object.placement
                };
                ((object.build)().into(), None, placement)
            }
            (None, Some(file), None) => {
                let scale = *self.scale.get_or_insert(1.0);
                let (mesh, report) = load(&folder.join(file), scale)?;
                (mesh.into(), Some(report), middle(skin))
            }
            (object, mesh, given) => {
                let found = [object.is_some(), mesh.is_some(), given.is_some()];
                return Err(MechanicsError::OneOf {
                    choices: "`press.object` and `press.mesh`",
                    found: found.into_iter().filter(|named| *named).count(),
                });
            }
        };
        for [row, col] in self.places.iter().flatten() {
            check_place("press.places: ", [Some(*row), Some(*col)], skin)?;
        }
        self.resolve_places()?;
        let written = Place {
            section: "press",
            row: &mut self.row,
            col: &mut self.col,
            position_m: &mut self.position_m,
            position_share: &mut self.position_share,
        };
        written.resolve(skin, [place.row, place.col])?;
        self.rotation_deg.get_or_insert(place.rotation_rad.to_degrees());
        self.tilt_deg
            .get_or_insert([place.tilt_x_rad.to_degrees(), place.tilt_y_rad.to_degrees()]);
        self.check()?;
        if let Some(report) = report.filter(|report| report.lids > 0) {
            self.check_lids(report.lids)?;
        }
        let [start_s, end_s] = self.plateau_s();
        if start_s >= end_s {
            return Err(MechanicsError::NoPlateau {
                start_s,
                end_s,
                onset_s: self.onset_s,
                onset_spread_s: self.onset_spread_s,
                rise_s: self.rise_s,
                lift_s: self.lift_s,
                lift_spread_s: self.lift_spread_s,
            });
        }
        Ok((mesh, report))
    }

    /// Makes the first of `places` the place that is written as `row` and `col`; a saved scene has both.
    fn resolve_places(&mut self) -> Result<(), MechanicsError> {
        let Some(places) = &self.places else { return Ok(()) };
        let Some(&[row, col]) = places.first() else {
            return Err(MechanicsError::NoPlaces);
        };
        let same = |written: Option<f64>, first: f64| written.is_none_or(|at| at.to_bits() == first.to_bits());
        let elsewhere = self.position_m.is_some() || self.position_share.is_some();
        if elsewhere || !same(self.row, row) || !same(self.col, col) {
            return Err(MechanicsError::PlacesAndPlace);
        }
        (self.row, self.col) = (Some(row), Some(col));
        Ok(())
    }

    /// Refuses a tilt that would press with the walls and the lid that close a mesh from above. The scatter counts with
    /// three times its standard deviation.
    fn check_lids(&self, lids: usize) -> Result<(), MechanicsError> {
        let [_, _, up] = self.placement().matrix();
        let leaning_deg = up[2].clamp(-1.0, 1.0).acos().to_degrees() + 3.0 * self.rotation_sd_deg;
        if leaning_deg <= MAX_LIDDED_TILT_DEG {
            return Ok(());
        }
        let [tilt_x_deg, tilt_y_deg] = self.tilt_deg.unwrap_or_default();
        Err(MechanicsError::TiltedLid {
            mesh: self.mesh.clone().unwrap_or_default(),
            lids,
            tilt_x_deg,
            tilt_y_deg,
            rotation_sd_deg: self.rotation_sd_deg,
            leaning_deg,
        })
    }

    fn check(&self) -> Result<(), ConfigError> {
        let within = |field: &str, value: f64, low: f64, high: f64, text| {
            in_range(&format!("press.{field}"), value, (low..=high).contains(&value), text).map(drop)
        };
        within(
            "rotation_deg",
            self.rotation_deg.unwrap_or_default(),
            -360.0,
            360.0,
            "[-360, 360]",
        )?;
        for tilt_deg in self.tilt_deg.unwrap_or_default() {
            within("tilt_deg", tilt_deg, -60.0, 60.0, "[-60, 60]")?;
        }
        if let Some(stiffness) = self.stiffness_pa_per_m {
            within("stiffness_pa_per_m", stiffness, 1e5, 1e12, "[1e5, 1e12] Pa/m")?;
        }
        within("force_n", self.force_n, 0.5, 100.0, "[0.5, 100] N")?;
        within("presses", self.presses as f64, 1.0, 1e5, "[1, 100000]")?;
        within("mass_kg", self.mass_kg, 1e-3, 4.0, "[1e-3, 4] kg")?;
        within("duration_s", self.duration_s, 0.5, 60.0, "[0.5, 60] s")?;
        within("onset_spread_s", self.onset_spread_s, 0.0, 1.0, "[0, 1] s")?;
        within(
            "onset_s",
            self.onset_s - self.onset_spread_s,
            0.25,
            30.0,
            "[0.25 + onset_spread_s, 30] s",
        )?;
        within("rise_s", self.rise_s, 0.1, 10.0, "[0.1, 10] s")?;
        within("fall_s", self.fall_s, 0.05, 10.0, "[0.05, 10] s")?;
        within("lift_spread_s", self.lift_spread_s, 0.0, 1.0, "[0, 1] s")?;
        within("lift_s", self.lift_s, 0.0, self.duration_s, "[0, duration_s]")?;
        within("position_sd_m", self.position_sd_m, 0.0, 0.01, "[0, 0.01] m")?;
        within("rotation_sd_deg", self.rotation_sd_deg, 0.0, 5.0, "[0, 5]")
    }
}

/// Upright in the middle of the sheet.
fn middle(skin: &SkinLayout) -> Placement {
    Placement {
        row: 0.5 * (skin.rows() as f64 - 1.0),
        col: 0.5 * (skin.cols() as f64 - 1.0),
        rotation_rad: 0.0,
        tilt_x_rad: 0.0,
        tilt_y_rad: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanics::{Mechanics, MechanicsError};
    use spts_contact::mesh::TriMesh;

    /// A bowl that opens upward: pressed upright and with a small tilt, refused when it leans by more than 5°, be it by
    /// two tilts that are small each or by the scatter. A closed mesh may lean as it likes.
    #[test]
    fn a_mesh_that_opens_upward_may_hardly_lean() {
        let dir = std::env::temp_dir().join(format!("spts-lids-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let mut bowl = TriMesh {
            vertices: vec![[0.0; 3]],
            triangles: Vec::new(),
        };
        for k in 0..24 {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / 24.0).sin_cos();
            bowl.vertices.push([0.02 * x, 0.02 * y, 0.02]);
            bowl.triangles.push([0, 1 + (k + 1) % 24, 1 + k]);
        }
        std::fs::write(dir.join("bowl.obj"), bowl.to_obj("bowl")).unwrap();
        // the same with a flat top
        bowl.triangles.extend((2..24).map(|k| [1, k, k + 1]));
        std::fs::write(dir.join("cone.obj"), bowl.to_obj("cone")).unwrap();
        let press = |mesh: &str, [x, y]: [f64; 2], sd: f64| {
            let text = format!(
                "[press]\nmesh = \"{mesh}.obj\"\nforce_n = 2.0\ntilt_deg = [{x:?}, {y:?}]\nrotation_sd_deg = {sd:?}\n\
                 [contact]\ncells_per_taxel = 2"
            );
            Mechanics::from_toml(&text, &dir)
        };
        for (tilt_deg, sd) in [([0.0, 0.0], 0.02), ([-4.9, 0.0], 0.02), ([3.5, 3.5], 0.0)] {
            assert_eq!(press("bowl", tilt_deg, sd).unwrap().mesh_report().unwrap().lids, 1);
        }
        // cos 60° cos 60° = cos 75.5°
        for (tilt_deg, sd, lean_deg) in [
            ([60.0, 0.0], 0.0, 60.0),
            ([60.0, 60.0], 0.0, 75.522),
            ([4.0, -4.0], 0.0, 5.6546),
            ([0.0, 0.0], 2.0, 6.0),
        ] {
            let error = press("bowl", tilt_deg, sd).unwrap_err();
            let said = error.to_string();
            assert!(
                matches!(error, MechanicsError::TiltedLid { leaning_deg, .. } if (leaning_deg - lean_deg).abs() < 1e-3),
                "{said}"
            );
            for fact in ["bowl.obj", "tilt_deg", "[0, 5]°"] {
                assert!(said.contains(fact), "{said}");
            }
            assert!(press("cone", tilt_deg, sd).is_ok());
        }
        std::fs::remove_dir_all(dir).unwrap();
    }
}
