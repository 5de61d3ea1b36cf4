//! What a method that finds trees by itself gives back.

/// Trees found without markers: each by its highest point.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Segments {
    /// Index of the highest point of every tree, from the highest tree down.
    pub tops: Vec<u32>,
    /// For every point the index of its tree in `tops`, or [`Segments::NONE`].
    pub tree: Vec<u32>,
}

impl Segments {
    /// The index of a point without a tree.
    pub const NONE: u32 = u32::MAX;
}
