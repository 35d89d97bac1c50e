//! Weights, summing amplifier, readout effects and ADC of the single-pixel tactile skin.
