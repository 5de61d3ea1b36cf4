//! Virtual forests and laser scanners with exact truth.
//!
//! A [`Scene`] is made of parameters and a seed: [`Terrain`] known exactly everywhere, a [`Forest`]
//! whose every tree is known, and an airborne scanner that looks at both from its flight lines. Its
//! points come piece by piece ([`Scene::points_in`], [`Scene::blocks`]), so that a scene may be
//! larger than memory.
//!
//! [`terrestrial`] has trees piece by piece, with every cylinder known, and a terrestrial scanner.
//!
//! The same parameters give the same points, to the last bit, on every machine, with any number of
//! threads and however the area is cut into pieces. This crate writes no file and knows nothing of
//! the pipeline.
//!
//! ```
//! use timberline_synth::{Scene, benchmark};
//! use timberline_pointcloud::TileGrid;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene = Scene::new(benchmark::stand(20_000, 7))?;
//! let tallest = &scene.forest().trees[0];
//! assert!(tallest.height_m > 15.0);
//! let points: usize = scene.blocks(TileGrid::new(32, [0, 0])?).map(|(_, cloud)| cloud.len()).sum();
//! assert!(points > 10_000);
//! # Ok(())
//! # }
//! ```

pub mod benchmark;
pub mod crown;
pub mod error;
pub mod forest;
pub mod plots;
pub mod pulse;
pub mod random;
pub mod sample;
pub mod scanner;
pub mod scene;
pub mod species;
pub mod stand;
pub mod tables;
pub mod terrain;
pub mod terrestrial;
pub mod tree;

mod canopy;
mod exposure;
mod foliage;
mod noise;

pub use crown::{Crown, Profile};
pub use error::Error;
pub use forest::Forest;
pub use plots::{FieldPlot, FieldTree, PlotKind};
pub use pulse::Undergrowth;
pub use sample::{SampleStand, SampleTile};
pub use scanner::ScannerParams;
pub use scene::{Scene, SceneParams};
pub use species::{Habit, Species};
pub use stand::{Cohort, Layout, Share, Stand, StandParams};
pub use terrain::{Gully, Relief, Surface, Terrain, TerrainParams};
pub use tree::{Layer, Tree};
