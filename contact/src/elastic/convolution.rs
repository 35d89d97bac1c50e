//! Convolution of a rectangle of cells with an even kernel by fast Fourier transforms.

use super::influence::Influence;
use spts_fft::num_traits::{AsPrimitive, Zero as _};
use spts_fft::{Complex, ComplexPlans, ComplexToReal, Fft, FftNum, Planner, RealPlans, RealToComplex};
use std::sync::Arc;

/// Columns transformed together: a row's share of them fills one or two cache lines.
const BLOCK: usize = 8;

/// Cyclic convolution on a padded rectangle, of which only the first `rows` × `cols` cells are given and wanted.
///
/// The kernel is even in both directions, so its spectrum is real. Rows and columns that hold only padding are never
/// transformed. Nothing is allocated after construction.
#[derive(Clone)]
pub(crate) struct Convolution<T: FftNum> {
    rows: usize,
    cols: usize,
    padded: [usize; 2],
    /// Column-major, scaled for unnormalised transforms.
    spectrum: Vec<T>,
    row_forward: Arc<dyn RealToComplex<T>>,
    row_inverse: Arc<dyn ComplexToReal<T>>,
    col_forward: Arc<dyn Fft<T>>,
    col_inverse: Arc<dyn Fft<T>>,
    /// Spectra of the rows, row-major.
    half: Vec<Complex<T>>,
    /// [`BLOCK`] columns.
    columns: Vec<Complex<T>>,
    line: Vec<T>,
    scratch: Vec<Complex<T>>,
}

impl<T: FftNum + AsPrimitive<f64>> Convolution<T>
where
    f64: AsPrimitive<T>,
{
    /// Convolution of `[rows, cols]` cells on the `padded` rectangle (second length even), for whose rows and columns
    /// the plans are. The kernel at the offset (i, j) is `kernel(i, j)`, 2 i ≤ rows, 2 j ≤ cols of the padded
    /// rectangle. `transfer` maps the kernel's spectrum to the one used.
    pub(crate) fn new(
        ((row_forward, row_inverse), (col_forward, col_inverse)): (RealPlans<T>, ComplexPlans<T>),
        [rows, cols]: [usize; 2],
        padded: [usize; 2],
        kernel: impl Fn(usize, usize) -> f64,
        transfer: impl Fn(f64) -> f64,
    ) -> Self {
        let [tall, wide] = padded;
        let scratch = row_forward
            .get_scratch_len()
            .max(row_inverse.get_scratch_len())
            .max(col_forward.get_inplace_scratch_len())
            .max(col_inverse.get_inplace_scratch_len());
        let width = wide / 2 + 1;
        let mut convolution = Self {
            rows,
            cols,
            padded,
            spectrum: vec![T::zero(); width * tall],
            row_forward,
            row_inverse,
            col_forward,
            col_inverse,
            half: vec![Complex::zero(); tall / 2 * width + width],
            columns: vec![Complex::zero(); BLOCK * tall],
            line: vec![T::zero(); wide],
            scratch: vec![Complex::zero(); scratch],
        };
        convolution.transform_kernel(&kernel, &transfer);
        convolution.half.resize(rows * width, Complex::zero());
        convolution
    }

    fn transform_kernel(&mut self, kernel: &impl Fn(usize, usize) -> f64, transfer: &impl Fn(f64) -> f64) {
        let [tall, wide] = self.padded;
        let width = wide / 2 + 1;
        for i in 0..=tall / 2 {
            for (j, value) in self.line.iter_mut().enumerate() {
                *value = kernel(i, j.min(wide - j)).as_();
            }
            let out = &mut self.half[i * width..(i + 1) * width];
            forward(&*self.row_forward, &mut self.line, out, &mut self.scratch);
        }
        let scale = 1.0 / (tall * wide) as f64;
        for j in 0..width {
            for i in 0..tall {
                self.columns[i] = self.half[i.min(tall - i) * width + j];
            }
            self.col_forward.process_with_scratch(&mut self.columns[..tall], &mut self.scratch);
            for i in 0..tall {
                self.spectrum[j * tall + i] = (transfer(self.columns[i].re.as_()) * scale).as_();
            }
        }
    }

    /// Mean of the transfer over all waves: the kernel of the convolution at offset 0.
    pub(crate) fn mean_transfer(&self) -> f64 {
        let [tall, wide] = self.padded;
        let width = wide / 2 + 1;
        let column = |j: usize| -> f64 { self.spectrum[j * tall..(j + 1) * tall].iter().map(|v| v.as_()).sum() };
        let inner: f64 = (1..width - 1).map(column).sum();
        column(0) + column(width - 1) + 2.0 * inner
    }

    /// output = kernel ∗ input, both `rows` × `cols`, row-major.
    pub(crate) fn apply(&mut self, input: &[T], output: &mut [T]) {
        let [tall, wide] = self.padded;
        let width = wide / 2 + 1;
        let (cols, rows) = (self.cols, self.rows);
        for (cells, out) in input.chunks_exact(cols).zip(self.half.chunks_exact_mut(width)) {
            self.line[..cols].copy_from_slice(cells);
            self.line[cols..].fill(T::zero());
            forward(&*self.row_forward, &mut self.line, out, &mut self.scratch);
        }
        let mut first = 0;
        while first < width {
            let count = BLOCK.min(width - first);
            let block = &mut self.columns[..count * tall];
            for column in block.chunks_exact_mut(tall) {
                column[rows..].fill(Complex::zero());
            }
            for (i, line) in self.half.chunks_exact(width).enumerate() {
                for (j, value) in line[first..first + count].iter().enumerate() {
                    block[j * tall + i] = *value;
                }
            }
            self.col_forward.process_with_scratch(block, &mut self.scratch);
            let spectrum = &self.spectrum[first * tall..(first + count) * tall];
            for (value, factor) in block.iter_mut().zip(spectrum) {
                *value = value.scale(*factor);
            }
            self.col_inverse.process_with_scratch(block, &mut self.scratch);
            for (i, line) in self.half.chunks_exact_mut(width).enumerate() {
                for (j, value) in line[first..first + count].iter_mut().enumerate() {
                    *value = block[j * tall + i];
                }
            }
            first += count;
        }
        for (line, cells) in self.half.chunks_exact_mut(width).zip(output.chunks_exact_mut(cols)) {
            inverse(&*self.row_inverse, line, &mut self.line, &mut self.scratch);
            cells.copy_from_slice(&self.line[..cols]);
        }
    }
}

/// Real row to its spectrum. The only error of the library is a wrong length, and all are made for this plan.
fn forward<T: FftNum>(plan: &dyn RealToComplex<T>, line: &mut [T], out: &mut [Complex<T>], scratch: &mut [Complex<T>]) {
    let done = plan.process_with_scratch(line, out, scratch);
    debug_assert!(done.is_ok(), "lengths of plan and buffers agree");
}

/// Spectrum to the real row; the library reports imaginary parts at both ends, left by round-off, after ignoring them.
fn inverse<T: FftNum>(
    plan: &dyn ComplexToReal<T>,
    spectrum: &mut [Complex<T>],
    line: &mut [T],
    scratch: &mut [Complex<T>],
) {
    if let (Some(first), last) = (spectrum.first().copied(), spectrum.len() - 1) {
        spectrum[0] = Complex::new(first.re, T::zero());
        spectrum[last].im = T::zero();
    }
    let done = plan.process_with_scratch(spectrum, line, scratch);
    debug_assert!(done.is_ok(), "lengths of plan and buffers agree");
}

/// Smallest even 2^a 3^b that is at least `length`: with a factor 5 or 7 the transforms take up to 1.6 times as long.
pub(crate) fn good_size(length: usize) -> usize {
    let mut size = length.max(2).next_multiple_of(2);
    loop {
        let mut rest = size >> size.trailing_zeros();
        while rest.is_multiple_of(3) {
            rest /= 3;
        }
        if rest == 1 {
            return size;
        }
        size += 2;
    }
}

// Elastic operator and preconditioner on a rectangle of cells.

/// Plans of both precisions.
pub(crate) struct Planners {
    double: Planner<f64>,
    single: Planner<f32>,
}

impl Planners {
    pub(crate) fn new() -> Self {
        Self { double: Planner::<f64>::new(), single: Planner::<f32>::new() }
    }
}

/// u = C p on a rectangle of `rows` × `cols` cells, and an approximate inverse.
///
/// The inverse is the circulant one: the same coefficients on a torus a little larger than the rectangle, whose
/// spectrum is inverted. It serves only to steer the iteration, so single precision does.
#[derive(Clone)]
pub(crate) struct System {
    pub(crate) shape: [usize; 2],
    elastic: Convolution<f64>,
    inverse: Convolution<f32>,
    /// Approximate pressure that lowers one free cell by one metre, Pa/m: the diagonal of the inverse.
    pub(crate) stiffness_pa_per_m: f64,
    /// Reciprocal of a cell's own coefficient, Pa/m.
    unit_pa_per_m: f64,
    /// What single cells have of compliance besides, m/Pa, or none.
    own_m_per_pa: Vec<f64>,
    /// By what the inverse is scaled on both sides for it: (1 + own / coefficient)^−½, or none.
    scale: Vec<f64>,
    input: Vec<f32>,
    output: Vec<f32>,
}

/// Cells of padding of the torus, so that opposite borders are not neighbours.
const TORUS_PADDING: usize = 4;

/// Offsets, beyond the rectangle's sides, at which [`System::new`] needs coefficients.
pub(crate) const EXTRA_OFFSETS: usize = 8;

impl System {
    /// System of `shape` cells; `diagonal_m_per_pa` is added to every cell's own coefficient (a body that yields).
    pub(crate) fn new(
        planners: &mut Planners,
        influence: &Influence,
        shape: [usize; 2],
        diagonal_m_per_pa: f64,
    ) -> Self {
        let at = |i: usize, j: usize| {
            let own = if i + j == 0 { diagonal_m_per_pa } else { 0.0 };
            influence.at(i, j) + own
        };
        let padded = shape.map(|n| good_size(2 * n - 1));
        let inside = |i: usize, j: usize| if i < shape[0] && j < shape[1] { at(i, j) } else { 0.0 };
        let plans = (planners.double.real(padded[1]), planners.double.complex(padded[0]));
        let elastic = Convolution::new(plans, shape, padded, inside, |c| c);
        let torus = shape.map(|n| good_size(n + TORUS_PADDING));
        let floor = FLOOR * at(0, 0);
        let scale = 1.0 / at(0, 0);
        // single precision does not reach down to 1e-12 m/Pa squared: work in units of the cell's own coefficient
        let relative = |i: usize, j: usize| at(i, j) * scale;
        let invert = |c: f64| 1.0 / c.max(floor * scale);
        let plans = (planners.single.real(torus[1]), planners.single.complex(torus[0]));
        let inverse = Convolution::new(plans, shape, torus, relative, invert);
        let cells = shape[0] * shape[1];
        let stiffness_pa_per_m = inverse.mean_transfer() * scale;
        Self {
            shape,
            elastic,
            inverse,
            stiffness_pa_per_m,
            unit_pa_per_m: scale,
            own_m_per_pa: Vec::new(),
            scale: Vec::new(),
            input: vec![0.0; cells],
            output: vec![0.0; cells],
        }
    }

    /// Gives single cells a compliance besides the body's: one number a cell, m/Pa, or none at all.
    pub(crate) fn set_own(&mut self, own_m_per_pa: impl Iterator<Item = f64>) {
        self.own_m_per_pa.clear();
        self.own_m_per_pa.extend(own_m_per_pa);
        self.scale.clear();
        let unit = self.unit_pa_per_m;
        self.scale.extend(self.own_m_per_pa.iter().map(|own| (1.0 + own * unit).sqrt().recip()));
    }

    /// displacement = C pressure.
    pub(crate) fn displace(&mut self, pressure: &[f64], displacement: &mut [f64]) {
        self.elastic.apply(pressure, displacement);
        for ((u, p), own) in displacement.iter_mut().zip(pressure).zip(&self.own_m_per_pa) {
            *u += own * p;
        }
    }

    /// direction = mask · C⁻¹ residual.
    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
    pub(crate) fn precondition(&mut self, residual: &[f64], mask: &[f64], direction: &mut [f64]) {
        // residuals near 1e-15 m would lose digits in single precision only below 1e-38: scale by the largest
        let largest = residual.iter().fold(f64::MIN_POSITIVE, |m, r| m.max(r.abs()));
        let inverse = 1.0 / largest;
        for (to, from) in self.input.iter_mut().zip(residual) {
            *to = (from * inverse) as f32;
        }
        for (to, scale) in self.input.iter_mut().zip(&self.scale) {
            *to *= *scale as f32;
        }
        let scale = largest * self.unit_pa_per_m;
        self.inverse.apply(&self.input, &mut self.output);
        for ((to, from), inside) in direction.iter_mut().zip(&self.output).zip(mask) {
            *to = f64::from(*from) * inside * scale;
        }
        for (to, scale) in direction.iter_mut().zip(&self.scale) {
            *to *= scale;
        }
    }
}

/// Smallest eigenvalue of the torus, in units of a cell's own coefficient: the kernel cut off at half the torus could
/// have a smaller one, even a negative one.
const FLOOR: f64 = 1e-3;
