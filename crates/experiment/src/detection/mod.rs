//! The weights behind the scores of treetops and trees, found on stands whose every point is known.
//!
//! A candidate is right when its point belongs to a true tree and no candidate of that tree is
//! higher. What the points around it say ([`timberline_treetops::evidence`]) gives its probability by
//! a logistic regression of second order ([`regression`]); its weights are printed as the source file
//! that `crates/treetops` is built with.

pub mod regression;
pub mod source;
pub mod training;

pub use regression::{Regression, Sample};
pub use training::{Training, trees, treetops};
