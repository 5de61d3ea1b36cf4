//! Accuracy against known truth.
