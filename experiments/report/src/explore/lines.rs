//! Lines of the exploration's tables.

use serde::Serialize;
use spts_circuit::amplifier::Limit;
use spts_studies::explore::{ExploreReport, ExploreTrial, SizeRow, Way};

/// A line of `explore.csv`.
#[derive(Debug, Serialize)]
pub(super) struct SizeLine {
    taxels: usize,
    contacts: usize,
    way: Way,
    wires: usize,
    limit: &'static str,
    feedback_ohm: f64,
    noise_gain: f64,
    settle_s: f64,
    period_s: f64,
    steps_per_taxel: f64,
    m_iou: Option<usize>,
    m_located: Option<usize>,
    best_iou: f64,
    acquire_s: Option<f64>,
    raster_s: f64,
    bytes: Option<usize>,
}

/// A line of `trials.csv`.
#[derive(Debug, Serialize)]
pub(super) struct TrialLine {
    taxels: usize,
    way: Way,
    wires: usize,
    measurements: usize,
    iou: f64,
    located: f64,
    bytes: usize,
}

/// A line of `timings.csv`.
#[derive(Debug, Serialize)]
pub(super) struct TimingLine {
    taxels: usize,
    way: Way,
    measurements: usize,
    decode_s: f64,
}

/// A line of `fits.csv`.
#[derive(Debug, Serialize)]
pub(super) struct FitLine {
    way: Way,
    cost: &'static str,
    exponent: f64,
    exponent_se: f64,
    prefactor: f64,
    points: usize,
}

pub(super) fn size_lines(report: &ExploreReport) -> Vec<SizeLine> {
    let line = |r: &SizeRow| SizeLine {
        taxels: r.taxels,
        contacts: r.contacts,
        way: r.way,
        wires: r.wires,
        limit: r.limit.map_or("", Limit::name),
        feedback_ohm: r.feedback_ohm,
        noise_gain: r.noise_gain,
        settle_s: r.settle_s,
        period_s: r.period_s,
        steps_per_taxel: r.steps_per_taxel,
        m_iou: r.m_iou,
        m_located: r.m_located,
        best_iou: r.best_iou(),
        acquire_s: r.acquire_s,
        raster_s: r.raster_s,
        bytes: r.deciding().map(|t| t.bytes),
    };
    report.rows.iter().map(line).collect()
}

pub(super) fn trial_lines(report: &ExploreReport) -> Vec<TrialLine> {
    let line = |(r, t): (&SizeRow, &ExploreTrial)| TrialLine {
        taxels: r.taxels,
        way: r.way,
        wires: r.wires,
        measurements: t.measurements,
        iou: t.iou,
        located: t.located,
        bytes: t.bytes,
    };
    trials(report).map(line).collect()
}

pub(super) fn timing_lines(report: &ExploreReport) -> Vec<TimingLine> {
    let line = |(r, t): (&SizeRow, &ExploreTrial)| TimingLine {
        taxels: r.taxels,
        way: r.way,
        measurements: t.measurements,
        decode_s: t.decode_s,
    };
    trials(report).map(line).collect()
}

fn trials(report: &ExploreReport) -> impl Iterator<Item = (&SizeRow, &ExploreTrial)> {
    report.rows.iter().flat_map(|r| r.trials.iter().map(move |t| (r, t)))
}

/// Fits of times of this machine, or all the others.
pub(super) fn fit_lines(report: &ExploreReport, times: bool) -> Vec<FitLine> {
    let fits = report.fits.iter().filter(|f| f.is_of_this_machine() == times);
    fits.map(|f| FitLine {
        way: f.way,
        cost: f.cost,
        exponent: f.law.exponent,
        exponent_se: f.law.exponent_se,
        prefactor: f.law.prefactor,
        points: f.law.points,
    })
    .collect()
}
