//! Presses and drops that are followed in time.

use super::spec;
use crate::make::Maker;

const COURSE: &str = "rows = 300\nreadout = \"ideal\"\n[object]\nfrom = \"objects\"\nnames = [\"T\"]\nrows_per_shape = 50
[pose]\nabout = \"placement\"\n[press]\nforce_n = 20\n[record]\nwhat = \"course\"\nwindows = 50\ninterval_s = 0.02\nbefore_s = 0.1\n";

/// Force on the skin at every window of press 0: nothing before the touch, the force asked for on the plateau, nothing
/// after the lift. Allowed on the plateau: 1 %, which the arm's force loop is tested to in its own crate.
fn follows_its_course(text: &str) {
    let spec = spec(text);
    let mut maker = Maker::new(&spec);
    let course: Vec<[f64; 2]> = (0..50)
        .map(|k| {
            let row = maker.row(k).unwrap();
            [row.time_s(), row.contact_force_n()]
        })
        .collect();
    let at = |time_s: f64| course.iter().find(|[t, _]| *t >= time_s - 1e-9).unwrap()[1];
    assert!((course[0][0] + 0.1).abs() < 1e-9, "{:?}", course[0]);
    for time_s in [-0.1, -0.06, 0.86, 0.88] {
        assert!(at(time_s) <= 0.0, "{} N at {time_s} s", at(time_s));
    }
    for time_s in [0.44, 0.5, 0.56] {
        assert!((at(time_s) / 20.0 - 1.0).abs() < 0.01, "{} N at {time_s} s", at(time_s));
    }
    let rising: Vec<f64> = course.iter().map(|[_, force]| *force).skip(5).take(20).collect();
    assert!(rising.windows(2).all(|pair| pair[1] > pair[0] - 0.2), "{rising:?}");
}

#[test]
fn a_balanced_press_follows_its_course() {
    follows_its_course(COURSE);
}

#[test]
fn a_stepped_press_follows_its_course() {
    follows_its_course(&format!("{COURSE}[contact]\nmodel = \"winkler\""));
}

/// Without effects y is Φ x, x being the conductance of the moment: from the middle of a window to its ends, 0.16 ms,
/// the force rises by less than 0.1 % of its plateau, and a conductance by less than 1 % of all on the plateau.
#[test]
fn samples_of_a_course_are_the_weighted_sums_of_their_moment() {
    let spec = spec(&format!("{COURSE}[contact]\nmodel = \"winkler\""));
    let volts_per_siemens = spts_circuit::Profile::named("ideal").unwrap().volts_per_siemens();
    let mut maker = Maker::new(&spec);
    let plateau: f64 = maker.row(30).unwrap().conductance().sum() * volts_per_siemens;
    for index in 0..50 {
        let row = maker.row(index).unwrap();
        let x: Vec<f64> = row
            .conductance()
            .values()
            .iter()
            .map(|g| g * volts_per_siemens)
            .collect();
        for (y, weights) in row.volts().iter().zip(row.phi().chunks_exact(100)) {
            let sum: f64 = weights.iter().zip(&x).map(|(w, x)| w * x).sum();
            assert!(
                (y - sum).abs() <= 0.01 * plateau,
                "window {index}: {y} and {sum} of {plateau}"
            );
        }
    }
}

/// A hold under a field that is stepped is the plateau of its course, and close to the balance of the same columns:
/// the arm, which gives way sideways, and the tilt that `footprint` neglects leave the forces of taxels 5 % apart at
/// most, in the mean.
#[test]
fn holds_of_two_fields_agree() {
    let text = |model: &str| {
        format!(
            "rows = 5\nseed = 4\n[object]\nfrom = \"objects\"\nnames = [\"T\"]\n[pose]\nabout = \"placement\"\n\
             [press]\nforce_n = {{ uniform = [5.0, 30.0] }}\n[contact]\nmodel = \"{model}\"\n[record]\nwindows = 1\n"
        )
    };
    let (balanced, stepped) = (spec(&text("footprint")), spec(&text("winkler")));
    let (mut a, mut b) = (Maker::new(&balanced), Maker::new(&stepped));
    for index in 0..5 {
        let (a, b) = (a.row(index).unwrap(), b.row(index).unwrap());
        assert!((a.time_s() - b.time_s()).abs() < 1e-12);
        let (forces, other) = (a.contact_force_n(), b.contact_force_n());
        assert!((other / forces - 1.0).abs() < 0.01, "{forces} N and {other} N");
        let pairs = a.pressure().values().iter().zip(b.pressure().values());
        let apart: f64 = pairs.map(|(p, q)| (p - q).abs()).sum::<f64>() / a.pressure().sum();
        assert!(apart < 0.05, "row {index}: {apart}");
    }
}

/// A ball meets the skin with √(2 g h), is felt, and is gone again; its speed to 1 %, since a step of 0.1 ms is 1 mm/s.
#[test]
fn drops_have_a_touch_and_an_end() {
    let spec = spec(
        "rows = 32\n[object]\nfrom = \"ball\"\n[pose]\nx_share = { uniform = [-0.3, 0.3] }\n[drop]\nheight_m = { grid = [0.1, 0.5] }\n\
         [record]\nwhat = \"drop\"\nwindows = 16\ninterval_s = 0.001\nbefore_s = 0.004",
    );
    let mut maker = Maker::new(&spec);
    for (drop, height_m) in [(0, 0.1_f64), (1, 0.5)] {
        let forces: Vec<[f64; 2]> = (0..16)
            .map(|k| {
                let row = maker.row(16 * drop + k).unwrap();
                [row.time_s(), row.contact_force_n()]
            })
            .collect();
        let row = maker.row(16 * drop).unwrap();
        let ball = row.object(0).unwrap().touch.ball.unwrap();
        let expected = (2.0 * 9.806_65 * height_m).sqrt();
        assert!(
            (ball.speed_m_per_s / expected - 1.0).abs() < 0.01,
            "{}",
            ball.speed_m_per_s
        );
        assert!(forces.iter().all(|[t, f]| *t > -2e-4 || *f <= 0.0), "{forces:?}");
        assert!(forces[15][1] <= 0.0, "{forces:?}");
        let most = forces.iter().map(|[_, f]| *f).fold(0.0, f64::max);
        assert!(most > 20.0, "{most} N");
    }
}

/// Rows in any order have the same bits, as those of holds have.
#[test]
fn a_moving_row_depends_on_its_number_alone() {
    let spec = spec(&format!("{COURSE}[skin]\npresses_before = 1\n"));
    let bits = |maker: &mut Maker<'_>, index: u64| -> Vec<u64> {
        let row = maker.row(index).unwrap();
        [row.volts(), row.image(), row.pressure().values()]
            .concat()
            .into_iter()
            .map(f64::to_bits)
            .collect()
    };
    let mut forward = Maker::new(&spec);
    let there: Vec<_> = [3, 49, 50, 130].map(|k| bits(&mut forward, k)).into();
    let mut backward = Maker::new(&spec);
    for (index, expected) in [130, 50, 49, 3].into_iter().zip(there.iter().rev()) {
        assert!(bits(&mut backward, index) == *expected, "row {index}");
    }
}

/// A ball so heavy that it is still on the skin when its last window ends has been followed all the same.
#[test]
fn a_bounce_need_not_end() {
    let spec =
        spec("rows = 16\n[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[drop]\nmass_kg = 50.0\nheight_m = 0.1");
    let mut maker = Maker::new(&spec);
    let forces: Vec<f64> = (0..16).map(|row| maker.row(row).unwrap().contact_force_n()).collect();
    assert!(forces[0] == 0.0 && forces[15] > 100.0, "{forces:?}");
}
