//! Placeholder.
pub(crate) const MEANS: [f64; 13] = [0.0; 13];
pub(crate) const SCALES: [f64; 13] = [1.0; 13];
pub(crate) const CONSTANT: f64 = 0.0;
pub(crate) const FACTORS: [f64; 104] = [0.0; 104];
