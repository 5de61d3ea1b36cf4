//! The orchestrator: reads campaign and pipeline files, plans, runs, caches, resumes, explains and
//! inspects. It knows no algorithm; stages are run through `timberline_artefact::stage` alone.

pub mod cli;
pub mod config;
pub mod engine;
pub mod las;
pub mod registry;
