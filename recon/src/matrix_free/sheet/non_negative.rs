//! The estimate without negative values, on the taxels that the linear one finds strongest.

use super::decoder::SheetDecoder;
use super::error::SheetError;
use crate::kernels::axpy;
use crate::matrix::Matrix;
use crate::problem::{Problem, Recover as _, Solution};
use crate::recover::{Gaussian, NnLmmse, Noise};
use crate::workspace::Workspace;
use std::sync::Arc;

impl SheetDecoder {
    /// The non-negative estimate from measurements of the first rows: N values, at most `most` of them positive.
    ///
    /// # Errors
    /// As [`SheetDecoder::linear`], and if the iteration fails because of rounding.
    pub fn non_negative(&self, y: &[f64], most: usize) -> Result<Vec<f64>, SheetError> {
        let linear = self.linear(y)?;
        let taxels = self.prior.taxels();
        let mut places: Vec<usize> = (0..taxels).collect();
        if most < taxels {
            places.sort_by(|a, b| linear[*b].total_cmp(&linear[*a]).then(a.cmp(b)));
            places.truncate(most.max(1));
            places.sort_unstable();
        }
        let values = self.solve(y, &places)?;
        let mut image = vec![0.0; taxels];
        places.iter().zip(&values).for_each(|(k, v)| image[*k] = *v);
        Ok(image)
    }

    /// The non-negative program on `places`.
    fn solve(&self, y: &[f64], places: &[usize]) -> Result<Vec<f64>, SheetError> {
        let (m, n, taxels) = (y.len(), places.len(), self.prior.taxels());
        let scale = y.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        if scale == 0.0 {
            return Ok(vec![0.0; n]);
        }
        let mut a = Matrix::zeros(m, n);
        for i in 0..m {
            let row = &self.rows[i * taxels..(i + 1) * taxels];
            a.row_mut(i).iter_mut().zip(places).for_each(|(v, k)| *v = row[*k]);
        }
        let mut y: Vec<f64> = y.iter().map(|v| v / scale).collect();
        self.whiten(&mut a, &mut y);
        let mut covariance = Matrix::zeros(n, n);
        for (r, i) in places.iter().enumerate() {
            let row = covariance.row_mut(r);
            row.iter_mut()
                .zip(places)
                .for_each(|(v, j)| *v = self.prior.covariance(*i, *j));
        }
        let noise = Noise::Absolute(self.noise.own * (n as f64 / self.count as f64).sqrt());
        let prior = Gaussian::new(vec![0.0; n], covariance)?;
        let estimate = NnLmmse::new(Arc::new(prior), noise)?;
        let mut solution = Solution::default();
        let problem = Problem::new(a.view(), &y)?;
        estimate.recover_into(&problem, &mut Workspace::default(), &mut solution)?;
        let mut values = vec![0.0; n];
        solution.scatter(&mut values);
        values.iter_mut().for_each(|v| *v *= scale);
        Ok(values)
    }

    /// Takes most of what is common to the rows of a wire off all columns: with own noise σ², common noise τ² and m
    /// rows, a share 1 − 1/√(1 + m τ²/σ²) of the mean, which leaves noise of σ² in every direction.
    fn whiten(&self, a: &mut Matrix, y: &mut [f64]) {
        let ratio = (self.noise.common / self.noise.own).powi(2);
        let wires = &self.wires[..y.len()];
        for wire in 0..self.count {
            let members: Vec<usize> = (0..y.len()).filter(|i| wires[*i] == wire).collect();
            let count = members.len() as f64;
            let share = 1.0 - 1.0 / (1.0 + count * ratio).sqrt();
            let mut mean = vec![0.0; a.ncols()];
            for i in &members {
                axpy(share / count, a.row(*i), &mut mean);
            }
            let mean_y = members.iter().map(|i| y[*i]).sum::<f64>() * share / count;
            for i in members {
                axpy(-1.0, &mean, a.row_mut(i));
                y[i] -= mean_y;
            }
        }
    }
}
