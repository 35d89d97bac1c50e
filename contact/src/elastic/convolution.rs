//! Convolution of a rectangle of cells with an even kernel by fast Fourier transforms.

use realfft::num_complex::Complex;
use realfft::num_traits::{AsPrimitive, Zero as _};
use realfft::{ComplexToReal, FftNum, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Plans of one precision, shared by all sizes.
pub(crate) struct Planner<T: FftNum> {
    rows: RealFftPlanner<T>,
    cols: FftPlanner<T>,
}

impl<T: FftNum> Planner<T> {
    pub(crate) fn new() -> Self {
        Self {
            rows: RealFftPlanner::new(),
            cols: FftPlanner::new(),
        }
    }
}

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
    /// Convolution of `[rows, cols]` cells on the `padded` rectangle (second length even), the kernel at the offset
    /// (i, j) being `kernel(i, j)`, 2 i ≤ rows, 2 j ≤ cols of the padded rectangle. `transfer` maps the kernel's
    /// spectrum to the one used.
    pub(crate) fn new(
        planner: &mut Planner<T>,
        [rows, cols]: [usize; 2],
        padded: [usize; 2],
        kernel: impl Fn(usize, usize) -> f64,
        transfer: impl Fn(f64) -> f64,
    ) -> Self {
        let [tall, wide] = padded;
        let row_forward = planner.rows.plan_fft_forward(wide);
        let row_inverse = planner.rows.plan_fft_inverse(wide);
        let col_forward = planner.cols.plan_fft_forward(tall);
        let col_inverse = planner.cols.plan_fft_inverse(tall);
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
            self.col_forward
                .process_with_scratch(&mut self.columns[..tall], &mut self.scratch);
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
