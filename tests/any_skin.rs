//! Skins of any size, from the press to the score: every layout and source of rows decodes with its own rows, and with
//! no others.

use crate::command::{json, succeeds};
use serde_json::Value;
use spts::chain::{Chain, ChainConfig, RowsConfig};
use spts_circuit::{CompressiveWeights, Constant, Mode, Profile, Readout, Seeding};
use spts_contact::mesh::extrude;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::MatrixView;
use std::path::Path;

/// A skin, and how it is pressed and decoded.
struct Skin {
    rows: usize,
    cols: usize,
    /// Numbers of measurements of the decodes, up to the number of taxels.
    measurements: &'static [usize],
}

fn listed(measurements: &[usize]) -> String {
    let all: Vec<String> = measurements.iter().map(usize::to_string).collect();
    all.join(",")
}

/// An angle of 36 mm × 32 mm, as a file of the user's own.
fn write_angle(folder: &Path) {
    let outline =
        [[-0.018, -0.016], [0.018, -0.016], [0.018, -0.004], [-0.006, -0.004], [-0.006, 0.016], [-0.018, 0.016]];
    let mesh = extrude(&outline, &[], 0.01);
    std::fs::write(folder.join("angle.obj"), mesh.to_obj("angle")).unwrap();
}

/// Windows a press that are decoded with wrong rows: their images are noise, and one of them may lie anywhere.
const WRONG_WINDOWS: usize = 4;

impl Skin {
    /// Presses the angle twice on the skin, 5 mm from taxel to taxel with mixed seeds, and records it with `readout`
    /// into `folder/out`.
    fn simulate(&self, folder: &Path, readout: &str, out: &str) {
        let (rows, cols) = (format!("skin.rows={}", self.rows), format!("skin.cols={}", self.cols));
        let scene = ["simulate", "press", "--mesh", "angle.obj", "--contact", "footprint", "--presses", "2"];
        let layout = ["--set", &rows, "--set", &cols, "--set", "skin.pitch_m=0.005", "--set", "rows.seeding=mixed"];
        let place = ["--rotation-deg", "20", "--set", "press.position_share=[0.05, -0.04]"];
        let rest = ["--seed", "4", "--readout", readout, "--out", out];
        succeeds(folder, &[&scene[..], &layout, &place, &rest].concat());
    }

    /// Mean IoU of `windows` decoded windows of both presses at each M of `measurements`, by a `decoder` that has
    /// learned nothing, so that what it sees are the rows.
    fn decoded(&self, decoder: &str, folder: &Path, session: &str, measurements: &[usize], windows: usize) -> Vec<f64> {
        let (m, w) = (listed(measurements), windows.to_string());
        let found: Value =
            json(folder, &["decode", session, "--decoder", decoder, "--measurements", &m, "--windows", &w, "--json"]);
        let rows = found["rows"].as_array().unwrap();
        let mean = |m: &usize| {
            let of_m = rows.iter().filter(|row| row["m"] == *m);
            let iou: Vec<f64> = of_m.map(|row| row["iou"].as_f64().unwrap()).collect();
            assert_eq!(iou.len(), 2 * windows);
            iou.iter().sum::<f64>() / iou.len() as f64
        };
        measurements.iter().map(mean).collect()
    }

    /// IoU of the decoders `nn_lmmse` and `mean_image` on the board at the second M.
    fn scored(&self, folder: &Path, session: &str) -> [f64; 2] {
        let m = self.measurements[1].to_string();
        let decoders = ["--decoder", "nn_lmmse,mean_image", "--no-times", "--no-ball", "--json"];
        let board: Value = json(folder, &[&["score", session, "--measurements", &m][..], &decoders].concat());
        ["nn_lmmse", "mean_image"].map(|name| {
            let row = board["rows"].as_array().unwrap().iter().find(|row| row["decoder"] == name);
            let row = row.unwrap_or_else(|| panic!("no row of {name}: {board}"));
            assert_eq!(row["learned_from"], "layout", "{row}");
            row["iou"].as_f64().unwrap()
        })
    }

    /// The whole chain. A press is well seen by as many measurements as there are taxels where nothing disturbs them;
    /// with wrong rows it is not seen at all.
    fn check(&self) {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        write_angle(dir);
        self.simulate(dir, "ideal", "ideal");
        self.simulate(dir, "as_built", "as_built");
        let name = format!("{} × {}", self.rows, self.cols);
        let [ideal, as_built] =
            ["ideal", "as_built"].map(|session| self.decoded("tv", dir, session, self.measurements, 1));
        eprintln!("{name}: M = {:?}: IoU {ideal:.3?} ideal, {as_built:.3?} as built", self.measurements);
        // above it the images differ by single taxels of some 60, whatever M is
        let seen_well = 0.9;
        for iou in [&ideal, &as_built] {
            let rises = |pair: &[f64]| pair[1] > pair[0] || pair.iter().all(|iou| *iou > seen_well);
            assert!(iou.windows(2).all(rises), "{name}: {iou:?}");
            assert!(iou[iou.len() - 1] > iou[0] + 0.2, "{name}: {iou:?}");
        }
        assert!(ideal[ideal.len() - 1] >= 0.75, "{name}: {ideal:?}");
        let [iou, mean_image] = self.scored(dir, "ideal");
        eprintln!("{name}: board at M = {}: {iou:.3}, mean image {mean_image:.3}", self.measurements[1]);
        assert!(iou > mean_image + 0.1, "{name}: {iou}, mean image {mean_image}");

        // the same samples with other rows, which total variation would try to fit for minutes
        let seen = || self.decoded("patches", dir, "ideal", &self.measurements[1..2], WRONG_WINDOWS)[0];
        let right = seen();
        assert!(right > mean_image + 0.1, "{name}: {right}, mean image {mean_image}");
        let path = dir.join("ideal/session.json");
        let mut session: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let seeding = &mut session["compressive"]["info"]["weights"]["seeding"];
        assert_eq!(*seeding, "mixed");
        *seeding = "address".into();
        std::fs::write(&path, session.to_string()).unwrap();
        let wrong = seen();
        eprintln!("{name}: IoU {wrong:.3} with wrong rows");
        assert!(wrong <= mean_image, "{name}: {wrong}, mean image {mean_image}");
    }
}

#[test]
fn a_skin_of_12_by_20_taxels_from_press_to_score() {
    Skin { rows: 12, cols: 20, measurements: &[12, 48, 120, 240] }.check();
}

#[test]
#[ignore = "presses and decodes 1024 taxels: half a minute"]
fn a_skin_of_32_by_32_taxels_from_press_to_score() {
    Skin { rows: 32, cols: 32, measurements: &[51, 205, 410] }.check();
}

/// Noiseless measurements at as many independent rows as there are taxels give the skin back, whatever the layout, the
/// levels and the source of the rows. Twice as many rows as taxels have full rank here, and a condition below 100; its
/// square times the rounding of a sum of 512 products is 1e-9.
#[test]
fn a_noiseless_recording_is_recovered_on_any_layout() {
    let own = |taxels: u32| (0..taxels).map(|k| Seeding::Mixed.seed(1_000_003 + 3 * k)).collect::<Vec<u32>>();
    for (rows, cols, pitch_m) in [(1, 64, 5e-3), (4, 4, 15e-3), (12, 20, 5e-3), (16, 16, 2e-3)] {
        let skin = SkinLayout::with_pitch(rows, cols, pitch_m).unwrap();
        let taxels = u32::try_from(skin.taxels()).unwrap();
        for levels in [CompressiveWeights::Binary, CompressiveWeights::Analog] {
            for seeds in [None, Some(own(taxels))] {
                let config = ChainConfig {
                    readout: Some("ideal".to_owned()),
                    rows: RowsConfig {
                        seeding: seeds.is_none().then_some(Seeding::Mixed),
                        seeds,
                        levels: Some(levels),
                        ..RowsConfig::default()
                    },
                    ..ChainConfig::default()
                };
                let chain = Chain::new(&config, &skin, 0, Path::new("")).unwrap();
                check_recovered(chain.profile(), &skin);
            }
        }
    }
}

fn check_recovered(profile: &Profile, skin: &SkinLayout) {
    let n = skin.taxels();
    let truth: Vec<f64> = (0..n).map(|k| 1e-6 * ((k * k) % 17) as f64).collect();
    let map = ConductanceMap::from_values(skin.rows(), skin.cols(), truth.clone());
    let mut readout = Readout::new(profile, Mode::Compressive, skin, Streams::new(3), 0).unwrap();
    let recording = readout.record(&mut [Constant::new(map).unwrap()], 2 * n, 0).unwrap();
    let phi = recording.rows(0, 0..2 * n).to_vec();
    let phi = MatrixView::new(2 * n, n, &phi).unwrap();
    let volts_per_siemens = profile.on(skin).unwrap().volts_per_siemens();
    let found = nalgebra::DMatrix::from_row_slice(2 * n, n, phi.values());
    let y = nalgebra::DVector::from_column_slice(&recording.blocks()[0].volts);
    let transposed = found.transpose();
    let normal = (&transposed * &found).cholesky().expect("rows of full rank");
    let x = normal.solve(&(transposed * y));
    let largest = 16e-6;
    for (k, (x, g)) in x.iter().zip(&truth).enumerate() {
        let error = (x / volts_per_siemens - g).abs() / largest;
        assert!(error < 2e-9, "{} × {}, {:?}, taxel {k}: {error}", skin.rows(), skin.cols(), profile.weights);
    }
}
