//! Maps and pictures of what the pipeline found.
//!
//! Drawn from plain arrays, pixel by pixel, without any system library or font: the same results
//! give the same picture, byte for byte. Nothing here computes a result.
//!
//! * [`map`]: the map of a site; [`stage`] makes one for every site of a campaign.
//! * [`pictures`]: single artefacts, for looking into a store.
//! * [`tree`]: one tree, points beside its model; [`plot`]: the stems of a plot from above.
//! * [`chart`]: curves in panels, as PNG and as SVG.
//! * [`figure`]: title, frame, legend, scale bar and north arrow around either.

pub mod canvas;
pub mod chart;
pub mod colour;
pub mod error;
pub mod figure;
pub mod grid;
pub mod hillshade;
pub mod map;
pub mod pictures;
pub mod plot;
pub mod stage;
pub mod text;
pub mod ticks;
pub mod tree;

pub use canvas::Canvas;
pub use chart::Chart;
pub use error::Error;
pub use grid::Grid;
