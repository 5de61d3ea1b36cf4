//! Trees piece by piece, and a virtual terrestrial scanner.

pub mod plot;
pub mod points;
pub mod scan_params;
pub mod shapes;
pub mod size;
pub mod species;
pub mod tree_model;
pub mod truth;
pub mod understorey;

mod axis;
mod beam;
mod branching;
mod bvh;
mod cylinder;
mod envelope;
mod ground_mesh;
mod growth;
mod leaves;
mod scanner;
mod taper;
mod targets;
mod vector;

pub use cylinder::{Leaf, TrueCylinder};
pub use growth::grow;
pub use plot::{PlotParams, PlotScene, plot};
pub use points::{Label, LabelledPoints};
pub use scan_params::{Layout, ScanParams, Station};
pub use scanner::scan_tree;
pub use size::TreeSize;
pub use species::TreeSpecies;
pub use tree_model::{TreeModel, TreeSurface, VolumeClass};
pub use understorey::Understorey;
