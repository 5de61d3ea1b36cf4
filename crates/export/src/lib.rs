//! What users take away: tables, GIS layers, rasters and point clouds.
//!
//! Writers over plain slices and artefact types, each usable alone; [`stage`] puts them together.
//! Nothing here computes a result: this crate knows no algorithm of forestry, only formats and the
//! surfaces to draw. Every
//! file is the same byte for byte when its contents are: no time, no order of tiles, no thread
//! count goes into it.
//!
//! * [`csv_table`] and [`table`]: `trees.csv` and its dictionary.
//! * [`gpkg`] and [`layers`]: `trees.gpkg`.
//! * [`geotiff`], [`vrt`], [`mosaic`]: rasters larger than memory.
//! * [`las`]: point files with extra dimensions.
//! * [`tree`]: tables, meshes and recordings of single trees.

pub mod crs;
pub mod csv_table;
pub mod error;
pub mod geokeys;
pub mod geotiff;
pub mod gpkg;
pub mod las;
pub mod layers;
pub mod mosaic;
pub mod sorted_trees;
pub mod stage;
pub mod table;
pub mod tree;
pub mod tree_columns;
pub mod vrt;

pub use error::Error;
pub use mosaic::Mosaic;
pub use timberline_pointcloud::Window;
