//! The consensus sets of crown models as segments (Tittmann et al. 2011, section 3).

use crate::{Claim, Crown, Error, SegmentationParams, Segmenter, View, label};

/// Gives a point to the crown model that claims it best ([`Crown::claim`]). Trees whose model does
/// not stand have no points.
#[derive(Debug, Clone, PartialEq)]
pub struct StarSac {
    /// Membership, largest reach, least height, room above the surface.
    pub params: SegmentationParams,
}

impl Segmenter for StarSac {
    fn reach_m(&self) -> f64 {
        self.params.reach_m
    }

    fn is_local(&self) -> bool {
        true
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        view.check()?;
        let standing = view.markers.iter().filter(|marker| marker.crown.radius_m > 0.0);
        let crowns: Vec<Crown> = standing.map(|marker| marker.crown).collect();
        label([view.x, view.y, view.z], view.height_m, &crowns, &self.params)
    }
}
