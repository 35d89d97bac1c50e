//! Sparse recovery, dictionaries, classification, localisation and metrics for compressive tactile images.
