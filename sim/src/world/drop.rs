//! The fall of the ball, and its bounces.

use crate::mechanics::{DropConfig, GRAVITY_M_PER_S2, Mechanics};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use spts_models::Streams;

/// One contact of the ball with the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// First instant with a force, s.
    pub start_s: f64,
    /// Time with a force, s.
    pub contact_s: f64,
    /// Speed towards the skin before the contact, m/s.
    pub speed_in_m_per_s: f64,
    /// Speed away from the skin after the contact, m/s.
    pub speed_out_m_per_s: f64,
    /// Largest normal force, N.
    pub peak_force_n: f64,
    /// Energy the ball lost (kinetic and potential), J.
    pub lost_j: f64,
    /// Work of the ball against the contact force, J. It equals the loss up to the error of the integration.
    pub work_j: f64,
}

impl Bounce {
    /// Coefficient of restitution.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        self.speed_out_m_per_s / self.speed_in_m_per_s
    }
}

/// Where a drop starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// Time of release, s.
    pub(crate) release_s: f64,
    /// Centre, m.
    pub(crate) centre_m: [f64; 3],
    /// Orientation (w, x, y, z).
    pub(crate) quaternion: [f64; 4],
}

impl Start {
    /// Start of drop `index`.
    pub(crate) fn new(scene: &Mechanics, config: &DropConfig, index: u64) -> Self {
        let mut rng = Streams::new(scene.seed()).rng("drop", index);
        let release_s = config.release_s + config.release_spread_s * (2.0 * rng.random::<f64>() - 1.0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let [x, y] = scene
            .skin()
            .position_m(config.row.unwrap_or_default(), config.col.unwrap_or_default());
        let centre_m = [
            x + config.position_sd_m * normal(),
            y + config.position_sd_m * normal(),
            config.height_m + config.radius_m,
        ];
        // four normal numbers, normalised, are a uniform orientation
        let q: [f64; 4] = std::array::from_fn(|_| normal());
        let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
        Self {
            release_s,
            centre_m,
            quaternion: q.map(|v| v / norm),
        }
    }
}

/// Follows the ball and notes its bounces.
#[derive(Debug, Clone)]
pub(crate) struct BounceLog {
    mass_kg: f64,
    last: Option<Sample>,
    open: Option<Bounce>,
    energy_in_j: f64,
    pub(crate) done: Vec<Bounce>,
}

/// State of the ball at one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) time_s: f64,
    pub(crate) height_m: f64,
    pub(crate) velocity_m_per_s: [f64; 3],
    pub(crate) force_n: [f64; 3],
}

impl BounceLog {
    pub(crate) fn new(mass_kg: f64) -> Self {
        Self {
            mass_kg,
            last: None,
            open: None,
            energy_in_j: 0.0,
            done: Vec::with_capacity(64),
        }
    }

    /// The first bounce; while it lasts, as far as it is known.
    pub(crate) fn first(&self) -> Option<Bounce> {
        self.done.first().copied().or(self.open)
    }

    fn energy_j(&self, s: &Sample) -> f64 {
        let speed2: f64 = s.velocity_m_per_s.iter().map(|v| v * v).sum();
        self.mass_kg * (0.5 * speed2 + GRAVITY_M_PER_S2 * s.height_m)
    }

    pub(crate) fn push(&mut self, now: Sample) {
        if let (Some(bounce), Some(last)) = (&mut self.open, &self.last) {
            // the velocity is updated first, so F · (v + v′)/2 dt is exactly the change of kinetic energy
            let power: f64 = (0..3)
                .map(|i| last.force_n[i] * 0.5 * (last.velocity_m_per_s[i] + now.velocity_m_per_s[i]))
                .sum();
            bounce.work_j -= power * (now.time_s - last.time_s);
            bounce.peak_force_n = bounce.peak_force_n.max(now.force_n[2]);
        }
        match self.open {
            None if now.force_n[2] > 0.0 => {
                self.energy_in_j = self.energy_j(&now);
                self.open = Some(Bounce {
                    start_s: now.time_s,
                    contact_s: 0.0,
                    speed_in_m_per_s: -now.velocity_m_per_s[2],
                    speed_out_m_per_s: 0.0,
                    peak_force_n: now.force_n[2],
                    lost_j: 0.0,
                    work_j: 0.0,
                });
            }
            Some(mut bounce) if now.force_n[2] <= 0.0 => {
                bounce.contact_s = now.time_s - bounce.start_s;
                bounce.speed_out_m_per_s = now.velocity_m_per_s[2];
                bounce.lost_j = self.energy_in_j - self.energy_j(&now);
                self.done.push(bounce);
                self.open = None;
            }
            _ => {}
        }
        self.last = Some(now);
    }
}
