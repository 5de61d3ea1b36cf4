//! Plans, runs, caches, resumes and explains.

pub mod execute;
pub mod explain;
pub mod lock;
pub mod memory;
pub mod notes;
pub mod panics;
pub mod plan;
pub mod progress;
pub mod runlog;
pub mod schedule;
pub mod store;
pub mod survey;
pub mod workdir;

pub use execute::{Options, Report, Runner, Selection};
pub use schedule::Limits;
pub use store::Store;
pub use survey::{Survey, Surveyor};
pub use workdir::WorkDir;
