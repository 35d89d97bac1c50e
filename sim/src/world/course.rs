//! Time course of the force in a press.

use spts_contact::Frame;

/// Time course of one press, from its frames. Times are interpolated between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressCourse {
    /// First frame with a force, s.
    pub onset_s: f64,
    /// Time of the rise from 10 to 90 % of the plateau, s.
    pub rise_s: f64,
    /// Mean over the plateau, N.
    pub plateau_n: f64,
    /// Largest deviation from the target on the plateau, N.
    pub plateau_error_n: f64,
    /// Highest force above the target, relative to it.
    pub overshoot: f64,
    /// When the force falls below 90 % of the plateau, s.
    pub lift_s: f64,
    /// Time of the fall from 90 to 10 % of the plateau, s.
    pub fall_s: f64,
    /// Largest [`Frame::imbalance`] of all frames.
    pub imbalance: f64,
}

impl PressCourse {
    /// Time course of `frames` with the target force `target_n` and the plateau `plateau_s` = [start, end]. `None`
    /// unless the force exceeds 90 % of the target before the plateau's end and falls below 10 % afterwards.
    #[must_use]
    pub fn of(frames: &[Frame], target_n: f64, plateau_s: [f64; 2], cell_area_m2: f64) -> Option<Self> {
        let force = |f: &Frame| f.wrench.force_n[2];
        let onset_s = frames.iter().find(|f| force(f) > 0.0)?.time_s;
        let on: Vec<f64> = frames
            .iter()
            .filter(|f| (plateau_s[0]..=plateau_s[1]).contains(&f.time_s))
            .map(force)
            .collect();
        let plateau_n = on.iter().sum::<f64>() / on.len() as f64;
        let middle_s = 0.5 * (plateau_s[0] + plateau_s[1]);
        let up = |share: f64| crossing(frames, share * plateau_n, |t| t <= middle_s, false);
        let down = |share: f64| crossing(frames, share * plateau_n, |t| t >= middle_s, true);
        let lift_s = down(0.9)?;
        Some(Self {
            onset_s,
            rise_s: up(0.9)? - up(0.1)?,
            plateau_n,
            plateau_error_n: on.iter().map(|f| (f - target_n).abs()).fold(0.0, f64::max),
            overshoot: frames.iter().map(force).fold(0.0, f64::max) / target_n - 1.0,
            lift_s,
            fall_s: down(0.1)? - lift_s,
            imbalance: frames.iter().map(|f| f.imbalance(cell_area_m2)).fold(0.0, f64::max),
        })
    }
}

/// First time, among those `within`, at which the force passes `level_n`.
fn crossing(frames: &[Frame], level_n: f64, within: impl Fn(f64) -> bool, falling: bool) -> Option<f64> {
    let force = |f: &Frame| f.wrench.force_n[2];
    let pair = frames.windows(2).find(|w| {
        let below = [force(&w[0]) < level_n, force(&w[1]) < level_n];
        within(w[1].time_s) && below == [!falling, falling]
    })?;
    let share = (level_n - force(&pair[0])) / (force(&pair[1]) - force(&pair[0]));
    Some(pair[0].time_s + share * (pair[1].time_s - pair[0].time_s))
}
