//! Ways to tell a place from measurements. A new one is a type here and a line in [`LOCATORS`].

use super::Tools;
use super::contact::Moved;
use crate::board::window::project;
use crate::score::quarter;
use spts_recon::localise::{BlobEvidence, centre_of_mass};
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::ReferenceOmp;
use spts_recon::{MatrixView, Problem, Recover as _, Solution, Workspace};

/// Tells places of one contact.
pub(super) trait Locate {
    /// Place (row, col) by the measurements `start..start + m`; `None` when they cannot be used.
    fn locate(&mut self, start: usize, m: usize) -> Option<[f64; 2]>;
}

type Start = for<'a> fn(&'a Tools, &'a Moved) -> Box<dyn Locate + 'a>;

/// Every locator.
pub(super) const LOCATORS: &[(&str, Start)] = &[
    ("middle", |tools, _| Box::new(Middle(middle(tools.shape)))),
    ("script_s5", |tools, moved| Box::new(Pursuit::new(tools, moved, true))),
    ("matched", |tools, moved| Box::new(Pursuit::new(tools, moved, false))),
    ("blob", |tools, moved| Box::new(Blob::new(tools, moved))),
];

/// Middle of a sheet.
pub(super) fn middle(shape: [usize; 2]) -> [f64; 2] {
    shape.map(|n| n.saturating_sub(1) as f64 / 2.0)
}

/// Baseline: the middle of the sheet, whatever was measured.
struct Middle([f64; 2]);

impl Locate for Middle {
    fn locate(&mut self, _: usize, _: usize) -> Option<[f64; 2]> {
        Some(self.0)
    }
}

/// Centre of mass of the image that the published pursuit recovers: as the script does, with weights {0, 1}, 5 atoms and the centre over
/// the positive values; or matched, with weights ±1, M/4 atoms and the centre above .23 of the maximum. An empty image is the middle.
struct Pursuit<'a> {
    tools: &'a Tools,
    y: &'a [f64],
    /// Φ·D of the whole contact.
    operator: Vec<f64>,
    script: bool,
    work: Workspace,
    solution: Solution,
    image: Vec<f64>,
}

impl<'a> Pursuit<'a> {
    fn new(tools: &'a Tools, moved: &'a Moved, script: bool) -> Self {
        let dictionary = &tools.dictionary;
        let mut operator = vec![0.0; moved.y.len() * dictionary.sums.len()];
        project(
            moved.signs.as_deref(),
            &moved.phi,
            &dictionary.tables,
            &dictionary.atoms,
            &mut operator,
        );
        if script {
            dictionary.to_unit_weights(&mut operator);
        }
        Self {
            tools,
            y: if script { &moved.volts } else { &moved.y },
            operator,
            script,
            work: Workspace::default(),
            solution: Solution::default(),
            image: vec![0.0; dictionary.atoms.nrows()],
        }
    }
}

impl Locate for Pursuit<'_> {
    fn locate(&mut self, start: usize, m: usize) -> Option<[f64; 2]> {
        let dictionary = &self.tools.dictionary;
        let atoms = dictionary.sums.len();
        let (sparsity, threshold) = if self.script {
            (5, 0.0)
        } else {
            (quarter(m), SUPPORT_THRESHOLD)
        };
        let a = MatrixView::new(m, atoms, &self.operator[start * atoms..(start + m) * atoms]).ok()?;
        let problem = Problem::new(a, &self.y[start..start + m]).ok()?;
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
    moved: &'a Moved,
    /// φᵀ·blob of every blob, for every measurement; what cannot be projected is left empty.
    projected: Vec<Vec<f64>>,
    evidence: BlobEvidence,
}

impl<'a> Blob<'a> {
    fn new(tools: &'a Tools, moved: &'a Moved) -> Self {
        let taxels = tools.shape[0] * tools.shape[1];
        let project = |row: &[f64]| {
            let mut projected = Vec::new();
            // weights of ±1 are in range; a blob without its row is refused below
            let _ = tools.localiser.project(row, &mut projected);
            projected
        };
        Self {
            tools,
            moved,
            projected: moved.phi.chunks_exact(taxels).map(project).collect(),
            evidence: tools.localiser.evidence(),
        }
    }
}

impl Locate for Blob<'_> {
    fn locate(&mut self, start: usize, m: usize) -> Option<[f64; 2]> {
        self.evidence.clear();
        for (projected, &y) in self.projected[start..start + m].iter().zip(&self.moved.y[start..]) {
            self.evidence.observe(projected, y).ok()?;
        }
        Some(self.tools.localiser.estimate(&mut self.evidence).position_px)
    }
}
