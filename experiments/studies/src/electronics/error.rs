//! Errors of the electronics study.

/// Why the closed forms cannot be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ElectronicsError {
    /// The profile `as_designed` is not usable.
    #[error("profile as_designed: {0}")]
    Profile(#[source] spts_input::Refusal),
    /// The profile `as_designed` lacks a stage.
    #[error("profile as_designed: no `compressive.{stage}`")]
    NoStage {
        /// Name of the stage.
        stage: &'static str,
    },
    /// The amplifier of `as_designed` lacks a value.
    #[error("profile as_designed: no number `compressive.amplifier.{field}`")]
    NoNumber {
        /// Name of the field.
        field: &'static str,
    },
    /// A stage of `as_designed` has a value that is not valid.
    #[error("profile as_designed: {0}")]
    Stage(#[from] toml::de::Error),
    /// The rate leaves no time to settle, or is not positive.
    #[error(
        "`rate-hz` = {rate_hz} is outside [1, {most:.0}): {busy_us:.3} µs of every period are spent before the drives change and after the sampling",
        most = 1.0 / busy_s,
        busy_us = busy_s * 1e6
    )]
    Rate {
        /// Measurements a second, Hz.
        rate_hz: f64,
        /// Part of every period in which the output cannot settle, s.
        busy_s: f64,
    },
    /// The capacitance of a bus with all taxels is negative or too large.
    #[error(
        "`--bus-pf` + {taxels} · `--taxel-pf` = {:.3e} pF is outside [0, {:e}] pF",
        bus_f * 1e12,
        largest_f * 1e12
    )]
    BusCapacitance {
        /// Taxels on the bus.
        taxels: u32,
        /// Capacitance of the bus, F.
        bus_f: f64,
        /// Largest valid capacitance, F.
        largest_f: f64,
    },
    /// A part of the amplifier, or the skin, has a value outside its range.
    #[error(transparent)]
    Amplifier(#[from] spts_models::ConfigError),
}
