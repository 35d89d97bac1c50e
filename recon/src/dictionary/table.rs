//! The dictionary learners by name.

use super::kmeans::KMeans;
use super::ksvd::{Ksvd, RankOne};
use super::learner::Learner;
use super::online::Online;

/// Builds a learner of `n_components` atoms for a target sparsity (`n_nonzero_coefs`) that looks at the images `n_iter` times; everything
/// else as by default.
pub type Build = fn(n_components: usize, n_nonzero_coefs: usize, n_iter: usize) -> Box<dyn Learner>;

/// Every learner by name. A new one is a file and a line here; [`conformance`](super::conformance) runs on all of them.
pub const LEARNERS: &[(&str, Build)] = &[
    ("ksvd", |n_components, n_nonzero_coefs, n_iter| {
        Box::new(Ksvd {
            n_components,
            n_nonzero_coefs,
            n_iter,
            ..Ksvd::default()
        })
    }),
    ("ksvd_exact", |n_components, n_nonzero_coefs, n_iter| {
        Box::new(Ksvd {
            n_components,
            n_nonzero_coefs,
            n_iter,
            rank_one: RankOne::Exact,
            ..Ksvd::default()
        })
    }),
    ("ksvd_fast", |n_components, n_nonzero_coefs, n_iter| {
        Box::new(Ksvd {
            n_components,
            n_nonzero_coefs,
            n_iter,
            ..Ksvd::fast()
        })
    }),
    ("online", |n_components, n_nonzero_coefs, n_iter| {
        Box::new(Online {
            n_components,
            n_nonzero_coefs,
            n_iter,
            ..Online::default()
        })
    }),
    ("k_means", |n_components, _, n_iter| {
        Box::new(KMeans {
            n_components,
            n_iter,
            spherical: false,
        })
    }),
    ("spherical_k_means", |n_components, _, n_iter| {
        Box::new(KMeans {
            n_components,
            n_iter,
            spherical: true,
        })
    }),
];
