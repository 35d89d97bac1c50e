//! Algorithms that locate a contact. A new one is a function here and a line in [`LOCATORS`].

use crate::decoders::quarter;
use crate::training::Dictionary;
use crate::windows::{Press, Window};
use spts_recon::localise::{Localiser, centre_of_mass};
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::ReferenceOmp;
use spts_recon::{MatrixView, Problem, Recover as _, Solution, Workspace};
use std::borrow::Cow;
use std::cell::OnceCell;

/// What locators work with.
pub(super) struct Tools {
    pub(super) shape: [usize; 2],
    /// Dictionary at all places.
    pub(super) dictionary: Dictionary,
    pub(super) localiser: Localiser,
}

/// A contact's measurements, and what more than one locator makes of them.
pub(super) struct Measured<'a> {
    press: &'a Press,
    /// Φ·D of all its rows, row-major.
    operator: OnceCell<Vec<f64>>,
}

impl<'a> Measured<'a> {
    pub(super) fn new(press: &'a Press) -> Self {
        Self { press, operator: OnceCell::new() }
    }

    /// Φ·D for the dictionary of `tools`.
    fn operator(&self, tools: &Tools) -> &[f64] {
        self.operator.get_or_init(|| {
            let mut operator = vec![0.0; self.press.len() * tools.dictionary.sums.len()];
            // a contact with a lost measurement has zeros, and no window of it is located
            if let Some(all) = self.press.window(0, self.press.len()) {
                tools.dictionary.project(all.phi, all.signs, &mut operator);
            }
            operator
        })
    }
}

/// Tells the place (row, col) of one contact by a window, which begins with the measurement of the given number of the
/// contact; `None` when it cannot be used.
pub(super) type Locate<'a> = Box<dyn FnMut(usize, &Window<'_>) -> Option<[f64; 2]> + 'a>;

/// A locator under its names.
pub(super) struct LocatorSpec {
    /// Name in tables.
    pub(super) name: &'static str,
    /// Label in figures and printed tables.
    label: &'static str,
    pub(super) start: for<'a> fn(&'a Tools, &'a Measured<'a>) -> Locate<'a>,
}

/// Label of the locator `name` in figures and printed tables; an unknown name is its own label.
pub fn locator_label(name: &str) -> &str {
    let known = LOCATORS.iter().find(|spec| spec.name == name);
    known.map_or(name, |spec| spec.label)
}

/// Locator of a contact as small as a taxel; the ball's is larger.
pub(super) const TAXEL: &str = "taxel";

/// Every locator.
pub(super) const LOCATORS: &[LocatorSpec] = &[
    LocatorSpec {
        name: "middle",
        label: "middle of the sheet",
        start: |tools, _| Box::new(|_, _| Some(middle(tools.shape))),
    },
    LocatorSpec {
        name: "script_s5",
        label: "script, 5 atoms",
        start: |tools, measured| pursuit(tools, measured, true),
    },
    LocatorSpec { name: "matched", label: "matched", start: |tools, measured| pursuit(tools, measured, false) },
    LocatorSpec { name: "blob", label: "blob evidence", start: blob },
    LocatorSpec {
        name: TAXEL,
        label: "touched taxel",
        start: |tools, _| Box::new(|_, window| taxel(tools.shape, window)),
    },
];

/// Middle of a sheet.
pub(super) fn middle(shape: [usize; 2]) -> [f64; 2] {
    shape.map(|n| n.saturating_sub(1) as f64 / 2.0)
}

/// The published pursuit on the dictionary at all places, as in the script or matched to the device.
fn pursuit<'a>(tools: &'a Tools, measured: &'a Measured<'a>, script: bool) -> Locate<'a> {
    let dictionary = &tools.dictionary;
    let atoms = dictionary.sums.len();
    let mut operator = Cow::Borrowed(measured.operator(tools));
    if script {
        dictionary.to_unit_weights(operator.to_mut());
    }
    let (mut work, mut solution) = (Workspace::default(), Solution::default());
    let mut image = vec![0.0; dictionary.atoms.nrows()];
    Box::new(move |start, window| {
        let m = window.y.len();
        let (sparsity, threshold, y) =
            if script { (5, 0.0, window.volts) } else { (quarter(m), SUPPORT_THRESHOLD, window.y) };
        let a = MatrixView::new(m, atoms, &operator[start * atoms..(start + m) * atoms]).ok()?;
        let problem = Problem::new(a, y).ok()?;
        let pursuit = ReferenceOmp::new(sparsity);
        pursuit.recover_into(&problem, &mut work, &mut solution).ok()?;
        solution.synthesise(dictionary.atoms.view(), &mut image);
        let centre = centre_of_mass(&image, tools.shape[1], threshold);
        Some(centre.unwrap_or_else(|| middle(tools.shape)))
    })
}

/// The evidence of round blobs of all widths at all places.
fn blob<'a>(tools: &'a Tools, measured: &'a Measured<'a>) -> Locate<'a> {
    let press = measured.press;
    let project = |row: &[f64]| {
        let mut projected = Vec::new();
        // rows of another size leave it empty, which no window accepts
        let _ = tools.localiser.project(row, &mut projected);
        projected
    };
    let all = press.window(0, press.len());
    let rows = all.map_or(&[][..], |all| all.phi.values());
    let projected: Vec<Vec<f64>> = rows.chunks_exact(tools.shape[0] * tools.shape[1]).map(project).collect();
    let mut evidence = tools.localiser.evidence();
    Box::new(move |start, window| {
        evidence.clear();
        for (projected, &y) in projected.get(start..)?.iter().zip(window.y) {
            evidence.observe(projected, y).ok()?;
        }
        Some(tools.localiser.estimate(&mut evidence).position_px)
    })
}

/// The taxel that alone explains most of a window: that with the largest Φᵀ y.
pub(super) fn taxel(shape: [usize; 2], window: &Window<'_>) -> Option<[f64; 2]> {
    let (taxels, cols) = (window.phi.ncols(), shape[1].max(1));
    let mut sums = vec![0.0; taxels];
    for (row, y) in window.phi.values().chunks_exact(taxels).zip(window.y) {
        sums.iter_mut().zip(row).for_each(|(sum, w)| *sum += w * y);
    }
    let most = (0..taxels).max_by(|a, b| sums[*a].total_cmp(&sums[*b]))?;
    Some([(most / cols) as f64, (most % cols) as f64])
}
