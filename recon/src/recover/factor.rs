//! QR factorisation that grows by one column in each step.

use crate::kernels::{self, LANES};
use crate::matrix::MatrixView;
use crate::recover::scaling::Scaled;

/// A column whose part outside the span of the others is below this share of its length adds nothing but rounding.
pub(crate) const DEPENDENT: f64 = 1e-10;

/// The residual counts as zero below this share of ‖y‖: a pursuit cannot resolve less in double precision.
pub(crate) const CONVERGED: f64 = 1e-13;

/// A_S = Q R by Gram–Schmidt, the projections Qᵀ y and the residual y − Q Qᵀ y.
#[derive(Debug, Default)]
pub(crate) struct Factor {
    /// Rows M, rounded up to whole lanes; the padding is zero.
    stride: usize,
    basis: Vec<f64>,
    /// Columns of R, one after the other; column n has n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
    residual: Vec<f64>,
    atoms: Vec<usize>,
}

impl Factor {
    /// No column, and `y` as the residual. Room is kept for `limit` columns.
    pub(crate) fn start(&mut self, y: &[f64], limit: usize) {
        self.stride = y.len().next_multiple_of(LANES);
        self.residual.clear();
        self.residual.extend_from_slice(y);
        self.residual.resize(self.stride, 0.0);
        for buffer in [&mut self.basis, &mut self.upper, &mut self.projections] {
            buffer.clear();
        }
        self.atoms.clear();
        self.basis.reserve(limit * self.stride);
        self.upper.reserve(limit * (limit + 1) / 2);
        self.projections.reserve(limit);
        self.atoms.reserve(limit);
    }

    /// No column but `atoms`, those that depend on earlier ones left out.
    pub(crate) fn restart(&mut self, problem: &Scaled<'_>, atoms: &[usize]) {
        self.start(problem.y, atoms.len());
        for &atom in atoms {
            self.push(problem.a, atom);
        }
    }

    /// Appends column `atom` of `a` and takes its direction out of the residual. False, and nothing is changed, when it
    /// lies in the span of the others.
    pub(crate) fn push(&mut self, a: MatrixView<'_>, atom: usize) -> bool {
        let (m, n) = (a.nrows(), self.atoms.len());
        let (basis_len, upper_len) = (n * self.stride, self.upper.len());
        self.basis.resize(basis_len + self.stride, 0.0);
        self.upper.resize(upper_len + n + 1, 0.0);
        let (done, q) = self.basis.split_at_mut(basis_len);
        a.copy_column(atom, &mut q[..m]);
        let square = kernels::dot(q, q);
        let rest = kernels::orthogonalise(done, q, &mut self.upper[upper_len..upper_len + n]);
        if rest.is_nan() || rest <= DEPENDENT * DEPENDENT * square {
            self.basis.truncate(basis_len);
            self.upper.truncate(upper_len);
            return false;
        }
        let length = rest.sqrt();
        self.upper[upper_len + n] = length;
        let inverse = 1.0 / length;
        q.iter_mut().for_each(|v| *v *= inverse);
        let projection = kernels::dot(q, &self.residual);
        kernels::axpy(-projection, q, &mut self.residual);
        self.projections.push(projection);
        self.atoms.push(atom);
        true
    }

    /// Columns, in the order they came.
    pub(crate) fn atoms(&self) -> &[usize] {
        &self.atoms
    }

    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        self.atoms.len()
    }

    /// y − A_S α, length M.
    pub(crate) fn residual(&self, m: usize) -> &[f64] {
        &self.residual[..m]
    }

    /// ‖y − A_S α‖₂.
    pub(crate) fn residual_norm(&self) -> f64 {
        kernels::dot(&self.residual, &self.residual).sqrt()
    }

    /// Least-squares coefficients; overwrites `alpha`.
    pub(crate) fn coefficients_into(&self, alpha: &mut Vec<f64>) {
        back_substitute(&self.upper, &self.projections, alpha);
    }
}

/// Solves R α = `projections`; `upper` holds the columns of R one after the other, column n with n + 1 entries.
/// Overwrites `alpha`.
pub(crate) fn back_substitute(upper: &[f64], projections: &[f64], alpha: &mut Vec<f64>) {
    alpha.clear();
    alpha.extend_from_slice(projections);
    for n in (0..alpha.len()).rev() {
        let column = &upper[n * (n + 1) / 2..][..=n];
        let (known, rest) = alpha.split_at_mut(n);
        rest[0] /= column[n];
        for (a, r) in known.iter_mut().zip(column) {
            *a -= rest[0] * r;
        }
    }
}
