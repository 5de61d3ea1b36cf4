//! Campaign and pipeline files: what users write, checked, and what it means.
//!
//! A file is read into a [`Document`] that remembers places, checked against a JSON Schema
//! ([`check`]) with all faults reported at once, and only then resolved into the types that the
//! engine works with ([`Campaign`], [`Pipeline`]): what a user wrote and what is in effect are two
//! types.

pub mod campaign;
pub mod check;
pub mod document;
pub mod pipeline;
pub mod problem;

pub use campaign::{Campaign, CampaignFile, Platform};
pub use document::Document;
pub use pipeline::{Pipeline, PipelineStage, Source};
pub use problem::{Place, Problem, Problems, nearest};
