//! The columns of a press and its window.

use crate::make::Row;
use crate::spec::{Label, Spec};
use crate::store::{Kind, Store};
use spts::recon::metrics::{SUPPORT_THRESHOLD, support};

/// How long a list column is.
pub(super) type Length = fn(&Spec) -> usize;

/// One value a row.
const ONE: Option<Length> = None;
/// One value a taxel.
const TAXELS: Option<Length> = Some(|spec| spec.skin().taxels());
/// One value a measurement.
const MEASUREMENTS: Option<Length> = Some(|spec| spec.config().record.measurements);
/// One value a measurement and taxel, row by row of Φ.
const PHI: Option<Length> = Some(|spec| spec.config().record.measurements * spec.skin().taxels());

/// Name, type, length, unit, description, which specs have it, and how a row fills it.
pub(super) type RowColumn = (
    &'static str,
    Kind,
    Option<Length>,
    &'static str,
    &'static str,
    fn(&Spec) -> bool,
    fn(&Row<'_>, &mut Store),
);

pub(super) const ALWAYS: fn(&Spec) -> bool = |_| true;

pub(super) const ROW_COLUMNS: &[RowColumn] = &[
    (
        "index",
        Kind::I64,
        ONE,
        "",
        "number of the row, from 0",
        ALWAYS,
        |r, s| s.integer(r.index()),
    ),
    (
        "split",
        Kind::Text,
        ONE,
        "",
        "train, validation or test",
        ALWAYS,
        |r, s| s.text(r.split()),
    ),
    (
        "press",
        Kind::I64,
        ONE,
        "",
        "number of the press; all its windows are in one split",
        ALWAYS,
        |r, s| s.integer(r.press()),
    ),
    (
        "window",
        Kind::I32,
        ONE,
        "",
        "number of the window within its press, from 0",
        ALWAYS,
        |r, s| s.integer(r.window() as u64),
    ),
    (
        "objects",
        Kind::I32,
        ONE,
        "",
        "number of objects on the skin",
        ALWAYS,
        |r, s| s.integer(r.objects() as u64),
    ),
    (
        "skin_seed",
        Kind::I64,
        ONE,
        "",
        "specimen of the skin: its taxels and parts",
        ALWAYS,
        |r, s| s.integer(r.skin_seed()),
    ),
    ("session", Kind::I64, ONE, "", "session of the skin", ALWAYS, |r, s| {
        s.integer(r.session())
    }),
    (
        "faults",
        Kind::I32,
        ONE,
        "",
        "number of faulty cells",
        ALWAYS,
        |r, s| s.integer(r.faults() as u64),
    ),
    (
        "presses_before",
        Kind::I32,
        ONE,
        "",
        "presses of the same kind before this one in the session",
        ALWAYS,
        |r, s| s.integer(r.presses_before() as u64),
    ),
    (
        "time_s",
        Kind::F32,
        ONE,
        "s",
        "time from the touch to the first measurement, below 0 before it",
        ALWAYS,
        |r, s| s.number(r.time_s()),
    ),
    (
        "contact_force_n",
        Kind::F32,
        ONE,
        "N",
        "normal force on the skin in this window: what the pressure adds up to",
        ALWAYS,
        |r, s| s.number(r.contact_force_n()),
    ),
    (
        "over_edge",
        Kind::Bool,
        ONE,
        "",
        "whether a part of an object lies beside the sheet",
        ALWAYS,
        |r, s| {
            s.flag((0..r.objects()).any(|k| r.object(k).is_some_and(|object| object.touch.over_edge)));
        },
    ),
    (
        "saturated",
        Kind::I32,
        ONE,
        "",
        "samples of y at an end of the converter or at a rail",
        ALWAYS,
        |r, s| s.integer(r.saturated()[0] as u64),
    ),
    (
        "saturated_raster",
        Kind::I32,
        ONE,
        "",
        "the same of the raster scan",
        |spec| spec.config().record.raster,
        |r, s| {
            s.integer(r.saturated()[1] as u64);
        },
    ),
    (
        "first_row",
        Kind::I64,
        ONE,
        "",
        "row of Φ of the first measurement, from the loading of the seeds; generator and seeds are in the file's footer",
        ALWAYS,
        |r, s| s.integer(r.first_row()),
    ),
    (
        "pressure_pa",
        Kind::F32,
        TAXELS,
        "Pa",
        "true mean pressure over every taxel's cell, row by row of the skin",
        |spec| Label::Pressure.is_in(spec),
        |r, s| {
            s.numbers(r.pressure().values());
        },
    ),
    (
        "conductance_s",
        Kind::F32,
        TAXELS,
        "S",
        "true conductance of every taxel",
        |spec| Label::Conductance.is_in(spec),
        |r, s| s.numbers(r.conductance().values()),
    ),
    (
        "support",
        Kind::Bool,
        TAXELS,
        "",
        "taxels above 23 % of the largest conductance",
        |spec| Label::Support.is_in(spec),
        |r, s| {
            s.mark(|out| support(r.conductance().values(), SUPPORT_THRESHOLD, out));
        },
    ),
    (
        "image_v",
        Kind::F32,
        TAXELS,
        "V",
        "image as the raster scan has it, noise included",
        |spec| spec.config().record.raster,
        |r, s| {
            s.numbers(r.image());
        },
    ),
    (
        "y_v",
        Kind::F32,
        MEASUREMENTS,
        "V",
        "the samples of the one wire",
        |spec| !spec.config().record.codes,
        |r, s| s.numbers(r.volts()),
    ),
    (
        "y_code",
        Kind::I32,
        MEASUREMENTS,
        "",
        "the samples of the one wire, as codes of the converter",
        |spec| spec.config().record.codes,
        |r, s| {
            s.integers(r.codes().map(i64::from));
        },
    ),
    (
        "phi",
        Kind::F32,
        PHI,
        "",
        "Φ of the samples: measurements × taxels, row by row",
        |spec| spec.config().record.phi,
        |r, s| s.numbers(&r.phi()),
    ),
];
