//! The models behind the scores of treetops and trees, found on stands whose every point is known.
//!
//! A candidate is right when its point belongs to a true tree and no candidate of that tree is
//! higher. What the points around it say ([`timberline_treetops::evidence`]), and later its crown
//! model and its rivals ([`timberline_crowns::detection`]), give its probability by boosted decision
//! trees ([`timberline_boosting`]).

pub mod training;

pub use training::{Training, trees, treetops};
