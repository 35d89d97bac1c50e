//! Algorithms that locate a contact. A new one is a type here and a line in [`LOCATORS`].

use crate::decoders::quarter;
use crate::training::Dictionary;
use crate::windows::{Press, Window};
use spts_recon::localise::{BlobEvidence, Localiser, centre_of_mass};
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::ReferenceOmp;
use spts_recon::{MatrixView, Problem, Recover as _, Solution, Workspace};

/// What locators work with.
pub(super) struct Tools {
    pub(super) shape: [usize; 2],
    /// Dictionary at all places.
    pub(super) dictionary: Dictionary,
    pub(super) localiser: Localiser,
}

/// Tells places of one contact.
pub(super) trait Locate {
    /// Place (row, col) by `window`, which begins with measurement `start` of the contact; `None` when it cannot be
    /// used.
    fn locate(&mut self, start: usize, window: &Window<'_>) -> Option<[f64; 2]>;
}

pub(super) type StartLocator = for<'a> fn(&'a Tools, &'a Press) -> Box<dyn Locate + 'a>;

/// A locator under its names.
pub(super) struct LocatorSpec {
    /// Name in tables.
    pub(super) name: &'static str,
    /// Label in figures and printed tables.
    label: &'static str,
    pub(super) start: StartLocator,
}

/// Label of the locator `name` in figures and printed tables; an unknown name is its own label.
#[must_use]
pub fn locator_label(name: &str) -> &str {
    LOCATORS
        .iter()
        .find(|spec| spec.name == name)
        .map_or(name, |spec| spec.label)
}

/// Locator of a contact as small as a taxel; the ball's is larger.
pub(super) const TAXEL: &str = "taxel";

/// Every locator.
pub(super) const LOCATORS: &[LocatorSpec] = &[
    spec("middle", "middle of the sheet", |tools, _| {
        Box::new(Middle(middle(tools.shape)))
    }),
    spec("script_s5", "script, 5 atoms", |tools, press| {
        Box::new(Pursuit::new(tools, press, true))
    }),
    spec("matched", "matched", |tools, press| {
        Box::new(Pursuit::new(tools, press, false))
    }),
    spec("blob", "blob evidence", |tools, press| {
        Box::new(Blob::new(tools, press))
    }),
    spec(TAXEL, "touched taxel", |tools, _| Box::new(Taxel(tools.shape))),
];

const fn spec(name: &'static str, label: &'static str, start: StartLocator) -> LocatorSpec {
    LocatorSpec { name, label, start }
}

/// Middle of a sheet.
pub(super) fn middle(shape: [usize; 2]) -> [f64; 2] {
    shape.map(|n| n.saturating_sub(1) as f64 / 2.0)
}

/// Baseline: the middle of the sheet, whatever was measured.
struct Middle([f64; 2]);

impl Locate for Middle {
    fn locate(&mut self, _: usize, _: &Window<'_>) -> Option<[f64; 2]> {
        Some(self.0)
    }
}

/// Centre of mass of the image that the published pursuit recovers: as the script does, with weights {0, 1}, 5 atoms
/// and the centre over the positive values; or matched, with weights ±1, M/4 atoms and the centre above .23 of the
/// maximum. An empty image is the middle.
struct Pursuit<'a> {
    tools: &'a Tools,
    /// Φ·D of the whole contact.
    operator: Vec<f64>,
    script: bool,
    work: Workspace,
    solution: Solution,
    image: Vec<f64>,
}

impl<'a> Pursuit<'a> {
    fn new(tools: &'a Tools, press: &'a Press, script: bool) -> Self {
        let dictionary = &tools.dictionary;
        let mut operator = vec![0.0; press.len() * dictionary.sums.len()];
        // a contact of which a sample was lost has no true place either, and is not asked for
        if let Some(all) = press.window(0, press.len()) {
            dictionary.project(all.phi, all.signs, &mut operator);
        }
        if script {
            dictionary.to_unit_weights(&mut operator);
        }
        Self {
            tools,
            operator,
            script,
            work: Workspace::default(),
            solution: Solution::default(),
            image: vec![0.0; dictionary.atoms.nrows()],
        }
    }
}

impl Locate for Pursuit<'_> {
    fn locate(&mut self, start: usize, window: &Window<'_>) -> Option<[f64; 2]> {
        let (dictionary, m) = (&self.tools.dictionary, window.y.len());
        let atoms = dictionary.sums.len();
        let (sparsity, threshold) = if self.script {
            (5, 0.0)
        } else {
            (quarter(m), SUPPORT_THRESHOLD)
        };
        let a = MatrixView::new(m, atoms, &self.operator[start * atoms..(start + m) * atoms]).ok()?;
        let y = if self.script { window.volts } else { window.y };
        let problem = Problem::new(a, y).ok()?;
        ReferenceOmp::new(sparsity)
            .recover_into(&problem, &mut self.work, &mut self.solution)
            .ok()?;
        self.solution.synthesise(dictionary.atoms.view(), &mut self.image);
        let centre = centre_of_mass(&self.image, self.tools.shape[1], threshold);
        Some(centre.unwrap_or_else(|| middle(self.tools.shape)))
    }
}

/// Posterior mean over blobs.
struct Blob<'a> {
    tools: &'a Tools,
    /// φᵀ·blob of every blob for every measurement; empty if the projection fails.
    projected: Vec<Vec<f64>>,
    evidence: BlobEvidence,
}

impl<'a> Blob<'a> {
    fn new(tools: &'a Tools, press: &'a Press) -> Self {
        let taxels = tools.shape[0] * tools.shape[1];
        let project = |row: &[f64]| {
            let mut projected = Vec::new();
            // weights of ±1 are in range; a blob without its row is refused below
            let _ = tools.localiser.project(row, &mut projected);
            projected
        };
        let all = press.window(0, press.len());
        let rows = all.map_or(&[][..], |all| all.phi.values()).chunks_exact(taxels);
        Self {
            tools,
            projected: rows.map(project).collect(),
            evidence: tools.localiser.evidence(),
        }
    }
}

impl Locate for Blob<'_> {
    fn locate(&mut self, start: usize, window: &Window<'_>) -> Option<[f64; 2]> {
        self.evidence.clear();
        for (projected, &y) in self.projected.get(start..)?.iter().zip(window.y) {
            self.evidence.observe(projected, y).ok()?;
        }
        Some(self.tools.localiser.estimate(&mut self.evidence).position_px)
    }
}

/// The taxel that explains most of the output on its own: the largest Φᵀy, as all columns are equally long.
pub(super) struct Taxel(pub(super) [usize; 2]);

impl Locate for Taxel {
    fn locate(&mut self, _: usize, window: &Window<'_>) -> Option<[f64; 2]> {
        let (taxels, cols) = (window.phi.ncols(), self.0[1].max(1));
        let mut sums = vec![0.0; taxels];
        for (row, y) in window.phi.values().chunks_exact(taxels).zip(window.y) {
            sums.iter_mut().zip(row).for_each(|(sum, w)| *sum += w * y);
        }
        let most = (0..taxels).max_by(|a, b| sums[*a].total_cmp(&sums[*b]))?;
        Some([(most / cols) as f64, (most % cols) as f64])
    }
}
