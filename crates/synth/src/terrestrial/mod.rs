//! Trees piece by piece, and a virtual terrestrial scanner.
//!
//! A [`TreeModel`] is a list of truncated cones ([`TrueCylinder`]: number, parent, branch, order, ends
//! and radii) and of leaves, so that DBH, taper, volumes and branches are known exactly. [`grow`]
//! makes one from a [`TreeSpecies`], a [`TreeSize`] and a seed; [`shapes`] has a pole, a bent tube and a
//! fork for exact tests. [`scan_tree`] looks at a single tree as [`ScanParams`] say: from tripods all
//! around ([`ScanParams::tls`]), from one side ([`ScanParams::one_sided`]), from a drone
//! ([`ScanParams::uav`]), without any error ([`ScanParams::exact`]). [`plot()`] plants several trees and
//! understorey on a slope; [`PlotScene::scan`] scans them from the plot's positions.
//!
//! A pulse is five rays over the beam's footprint. Where they end at surfaces close together their
//! mean range is measured (a mixed pixel), otherwise there are several returns; wood and leaves hide
//! what lies behind them; ranges have Gaussian noise; seldom a point lies nowhere.
//! [`LabelledPoints`] tells of every point which tree, which piece and which kind of surface it comes
//! from. The same arguments give the same bits on every machine, with any number of threads.
//!
//! ```
//! use timberline_synth::terrestrial::{
//!     Label, ScanParams, TreeSize, TreeSpecies, VolumeClass, grow, scan_tree,
//! };
//! # fn main() -> Result<(), timberline_synth::Error> {
//! let size = TreeSize::of_dbh(TreeSpecies::EuropeanBeech, 0.21).leafless();
//! let tree = grow(TreeSpecies::EuropeanBeech, &size, 7)?.at([500_000.0, 5_000_000.0, 812.5]);
//! assert!((tree.dbh_m() - 0.21).abs() < 1e-9);
//! assert!(tree.volume_m3(VolumeClass::Stem) > tree.volume_m3(VolumeClass::ThickBranches));
//!
//! let points = scan_tree(&tree, &ScanParams::tls().with_step(0.5).with_ground(), 1)?;
//! let surface = tree.surface();
//! let wood = (0..points.len()).filter(|&i| points.label[i] == Label::Wood && !points.mixed[i]);
//! let off_m: Vec<f64> = wood.map(|i| surface.signed_distance_m(points.cloud.world(i))).collect();
//! assert!(off_m.iter().filter(|off| off.abs() < 0.01).count() > off_m.len() * 9 / 10);
//! # Ok(())
//! # }
//! ```
//!
//! What the true surface is: the sides of the truncated cones, balls that fill the outer wedge where a
//! branch bends, and discs at tips and at the foot. A branch starts within its parent, just deep
//! enough that its end does not stand out; the little wood at its rim that both hold is counted
//! twice.

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
