use super::*;
use spts::Session;
use spts::session::{Event, Recorded};
use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
use spts_models::SkinLayout;
use spts_recon::Matrix;

fn library(images: &[&[f64]]) -> Library {
    let labels: Vec<usize> = (1..=images.len()).collect();
    Library::new(&Matrix::from_column_slices(3, images), &labels).unwrap()
}

/// Two objects on two taxels whose gains are e^±a, all ratios exact. With the amplitude free, the difference of the two
/// log gains has a prior of variance 2σ² and two measurements of variance 2(σ_c² + σₘ²): it is 2a · 2/(2 + (σ_c² +
/// σₘ²)/σ²).
#[test]
fn gains_shrink_as_the_regression_says() {
    let a = 0.2_f64;
    let simulated = library(&[&[1.0, 1.0, 0.0], &[2.0, 2.0, 0.0]]);
    let skin = library(&[&[a.exp(), (-a).exp(), 0.0], &[a.exp(), (-a).exp(), 0.5]]);
    let found = SkinGains::estimate(&skin, &simulated, 0.1).unwrap();
    let ridge = (found.contact_log_sd.powi(2) + 0.1_f64.powi(2)) / found.spread_log_sd.powi(2);
    let mean = &found.gains.log_mean;
    let expected = 2.0 * a * 2.0 / (2.0 + ridge);
    let got = mean[0] - mean[1];
    assert!((got - expected).abs() < 1e-12, "{got}, expected {expected}");
    assert!(mean[2].abs() < 1e-15, "nothing has touched it");
    assert!((found.gains.log_sd[2] - found.spread_log_sd).abs() < 1e-12);
    assert!(found.gains.log_sd[0] < found.spread_log_sd);
    assert_eq!(found.sessions, [2, 2, 0]);
}

#[test]
fn what_has_no_pair_is_refused() {
    let one = library(&[&[1.0, 0.0, 0.0]]);
    let other = Library::new(&Matrix::from_column_slices(3, &[&[1.0, 0.0, 0.0]]), &[7]).unwrap();
    assert_eq!(SkinGains::estimate(&one, &other, 0.1), Err(SkinGainsError::NoPair));
    let larger = Library::new(&Matrix::from_column_slices(4, &[&[1.0; 4]]), &[1]).unwrap();
    assert!(matches!(
        SkinGains::estimate(&one, &larger, 0.1),
        Err(SkinGainsError::Shape { .. })
    ));
}

/// A pair of presses has opposite deviations: the geometric mean of their images is that of the mean gains.
#[test]
fn pairs_of_skins_have_the_mean_gains() {
    let gains = TaxelGains {
        shape: None,
        log_mean: vec![0.4, -0.2, 0.0],
        log_sd: vec![0.1, 0.3, 0.0],
        mounting_log_sd: 0.1,
    };
    let layout = SkinLayout::new(1, 3, 5e-3, 3e-3).unwrap();
    let info = RecordingInfo::new(layout, Weights::new(WeightMode::Raster, Seeding::Mixed, 3), 64_300.0);
    let block = |k: u64| Block {
        frame_position: 100 * k,
        idle_frames: Some(0),
        volts: vec![1.0; 3 * 20],
    };
    let raster = Recording::new(info, (1..=2).map(block).collect()).unwrap();
    let session = Session {
        hold_s: Some([0.0, 1e-3]),
        raster: Some(Recorded::new(raster)),
        ..Session::new("rec", Event::Press)
    };
    let session = ScoredSession::new(session, 1);
    let shown = on_skins_with(&gains, std::slice::from_ref(&session), Streams::new(4)).unwrap();
    let [before, after] = [&session, &shown[0]].map(|s| s.raster.as_ref().unwrap().clone());
    for (taxel, mean) in gains.log_mean.iter().enumerate() {
        let log = |press: usize| (after.volts(press, 3)[taxel] / before.volts(press, 3)[taxel]).ln();
        let (first, second) = (log(0), log(1));
        assert!((f64::midpoint(first, second) - mean).abs() < 1e-12, "{taxel}");
        assert!((first - second).abs() > 1e-3, "{taxel}: skins differ");
    }
}
