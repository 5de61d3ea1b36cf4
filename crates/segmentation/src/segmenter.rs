//! What a segmenter is given and what it gives back.

use crate::methods::{Li, Ncut, RasterSegmenter, StarSac};
use crate::{Claim, Crown, Error, SegmentMethod, SegmentationParams};
use timberline_pointcloud::Frame;

/// A tree whose points are sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Its crown model; its id is that of the tree. The radius is 0 where no model stands.
    pub crown: Crown,
    /// Height of the apex above ground, m.
    pub height_m: f64,
    /// How sure it is that this is a tree, 0 to 1.
    pub score: f32,
}

/// The points of a piece of forest with its surroundings, and the trees in it.
///
/// Points are in canonical order, trees sorted by id. Everything laid out in the plane must be laid
/// out on a lattice that is fixed in the world, which `frame` tells.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Where the coordinates count from.
    pub frame: Frame,
    /// Easting, m.
    pub x: &'a [f64],
    /// Northing, m.
    pub y: &'a [f64],
    /// Elevation, m.
    pub z: &'a [f64],
    /// Height above ground, m; NaN where unknown: such a point has no tree.
    pub height_m: &'a [f32],
    /// Whether a point is the first return of its pulse, or may be for all the file says.
    pub is_first: &'a [bool],
    /// The trees.
    pub markers: &'a [Marker],
}

impl View<'_> {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Checks that all columns have a value for every point.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn check(&self) -> Result<(), Error> {
        let columns = [
            ("y", self.y.len()),
            ("z", self.z.len()),
            ("height", self.height_m.len()),
            ("first return", self.is_first.len()),
        ];
        Error::check_lengths(self.len(), &columns)
    }
}

/// Points and trees that a [`View`] can look at.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Piece {
    /// See [`View::frame`].
    pub frame: Frame,
    /// See [`View::x`].
    pub x: Vec<f64>,
    /// See [`View::y`].
    pub y: Vec<f64>,
    /// See [`View::z`].
    pub z: Vec<f64>,
    /// See [`View::height_m`].
    pub height_m: Vec<f32>,
    /// See [`View::is_first`].
    pub is_first: Vec<bool>,
    /// See [`View::markers`].
    pub markers: Vec<Marker>,
}

impl Piece {
    /// Looks at it.
    #[must_use]
    pub fn view(&self) -> View<'_> {
        View {
            frame: self.frame,
            x: &self.x,
            y: &self.y,
            z: &self.z,
            height_m: &self.height_m,
            is_first: &self.is_first,
            markers: &self.markers,
        }
    }
}

/// Gives points their trees.
///
/// The trees are given, and every id returned is one of theirs: detection decides what is a tree,
/// segmentation how far it reaches. Where it is not [`Segmenter::is_local`] it is run in blocks that
/// are fixed in the world ([`crate::blocks`]), so that how points are cut into tiles does not matter.
pub trait Segmenter: Sync {
    /// How far from a point its tree may depend on other points and trees, in the plane, m; for a
    /// segmenter that is run in blocks, how much surroundings a block needs.
    fn reach_m(&self) -> f64;

    /// Whether what it says about a point depends on that point and on trees within the reach, and
    /// on nothing else: not on other points, nor on trees further away.
    fn is_local(&self) -> bool {
        false
    }

    /// The tree of every point, with a score from 0 to 1: 0 for no tree (id 0); above 1/2 where the
    /// point is on the surface of its tree's crown, which alone the crown is fitted to.
    ///
    /// # Errors
    /// When the view is inconsistent. That a tree has no points is no error.
    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error>;
}

/// The segmenter that the parameters name.
#[must_use]
pub fn segmenter(params: &SegmentationParams) -> Box<dyn Segmenter> {
    match params.method {
        SegmentMethod::Starsac => Box::new(StarSac { params: params.clone() }),
        SegmentMethod::Watershed | SegmentMethod::Dalponte | SegmentMethod::Silva => {
            Box::new(RasterSegmenter { params: params.clone() })
        }
        SegmentMethod::Li => Box::new(Li { params: params.clone() }),
        SegmentMethod::Ncut => Box::new(Ncut { params: params.clone() }),
    }
}
