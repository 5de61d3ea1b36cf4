//! Trees grown from given tops.

use super::asked::Asked;
use super::{LiParams, Ranked};
use crate::methods::raster::NO_TREE;
use crate::methods::surface;
use crate::{Claim, Error, Marker, SegmentationParams, Segmenter, View};

/// [`super::trees`] with the trees given, and all grown at once.
///
/// From the highest point down, each has the tree of the nearest point in the plane that was asked
/// before it, markers among them, if that is no further than the gap for its height and the tree's
/// top no further than the largest radius. A point further away would start a tree of its own; as
/// trees are given it has none, and no point has its tree from it.
///
/// Growing one tree after the other, as the paper does, gives the higher tree what lies between.
#[derive(Debug, Clone, PartialEq)]
pub struct Li {
    /// Those named `li_`, `min_height_m`, and those for the canopy's surface and trees below it.
    pub params: SegmentationParams,
}

impl Segmenter for Li {
    /// A crown, and those it meets.
    fn reach_m(&self) -> f64 {
        (2.0 * self.params.li_radius_m).max(self.params.reach_m)
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        view.check()?;
        surface::claims(view, &grow(view, &LiParams::of(&self.params)), &self.params)
    }
}

/// For every point the index of its marker, or [`NO_TREE`].
#[must_use]
pub fn grow(view: &View<'_>, params: &LiParams) -> Vec<u32> {
    let ranked = Ranked::new(view.x, view.y, view.height_m, params.min_height_m);
    let seeds = seeds(view.markers, &ranked);
    // Where trees are few, most points are far from all that were asked: no search goes further than
    // it could help.
    let reach_m = params.gap_low_m.max(params.gap_high_m);
    let mut asked = Asked::over(&ranked.x, &ranked.y);
    let mut coming = seeds.iter().zip(0..).peekable();
    let mut tree = vec![NO_TREE; view.len()];
    for (rank, &index) in ranked.index.iter().enumerate() {
        while let Some((seed, label)) = coming.next_if(|(seed, _)| seed.rank <= rank) {
            asked.insert(seed.at, label);
        }
        let at = [ranked.x[rank], ranked.y[rank]];
        let (squared, label) = asked.nearest(at, reach_m);
        let Some(seed) = seeds.get(label as usize) else {
            continue;
        };
        let near = squared.sqrt() <= params.gap_m(ranked.height_m[rank]);
        if near && squared_m2(at, seed.at) <= params.max_radius_m * params.max_radius_m {
            asked.insert(at, label);
            tree[index as usize] = seed.marker;
        }
    }
    tree
}

fn squared_m2(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

/// Where a tree starts.
#[derive(Debug, Clone, Copy)]
struct Seed {
    at: [f64; 2],
    /// First point that is not higher.
    rank: usize,
    marker: u32,
}

/// The markers' tops from the highest down, equal ones by id.
fn seeds(markers: &[Marker], ranked: &Ranked) -> Vec<Seed> {
    let mut order: Vec<(u32, &Marker)> = (0..).zip(markers).collect();
    order.sort_by(|(_, a), (_, b)| {
        b.height_m.total_cmp(&a.height_m).then(a.crown.id.cmp(&b.crown.id))
    });
    let seed = |(marker, of): (u32, &Marker)| {
        let rank = ranked.height_m.partition_point(|height_m| *height_m > of.height_m);
        Seed { at: [of.crown.apex[0], of.crown.apex[1]], rank, marker }
    };
    order.into_iter().map(seed).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Crown, Piece};

    fn marker(id: u64, x: f64, height_m: f64) -> Marker {
        let apex = [x, 0.0, height_m];
        let (coefficients, tolerance_m) = ([0.0; 2], 0.6);
        let crown = Crown { id, apex, coefficients, radius_m: 0.0, tolerance_m, oblique: false };
        Marker { crown, height_m, score: 1.0 }
    }

    /// A ridge of two tops with a point every quarter of a metre, then a gap, then a tree without a
    /// marker.
    fn ridge() -> Piece {
        let mut piece =
            Piece { markers: vec![marker(5, 0.0, 20.0), marker(3, 6.0, 18.0)], ..Piece::default() };
        for i in -16..80 {
            let x = 0.25 * f64::from(i);
            let height = (20.0 - x.abs()).max(18.0 - (x - 6.0).abs()).max(16.0 - (x - 15.0).abs());
            if !(9.0..13.0).contains(&x) {
                piece.x.push(x);
                piece.y.push(0.0);
                piece.z.push(100.0 + height);
                piece.height_m.push(height as f32);
                piece.is_first.push(true);
            }
        }
        piece
    }

    #[test]
    fn trees_meet_in_the_valley_and_stop_at_the_gap() {
        let piece = ridge();
        let claims = Li { params: SegmentationParams::default() }.segment(&piece.view()).unwrap();
        let at = |x: f64| claims[piece.x.iter().position(|other| *other == x).unwrap()].id;
        assert_eq!([-3.0, 0.0, 3.75, 4.25, 8.0].map(at), [5, 5, 5, 3, 3]);
        assert_eq!([13.0, 15.0, 19.0].map(at), [0; 3], "no tree is given there");
        assert!(claims.iter().all(|claim| (claim.id == 0) == (claim.score == 0.0)));
        assert!(claims.iter().filter(|claim| claim.score > 0.5).count() > 40);
    }

    #[test]
    fn the_largest_radius_and_the_least_height_hold() {
        let piece = ridge();
        let params = LiParams { max_radius_m: 2.0, min_height_m: 19.0, ..LiParams::default() };
        let tree = grow(&piece.view(), &params);
        assert_eq!(tree.iter().filter(|tree| **tree == 0).count(), 9);
        assert!(tree.iter().all(|tree| [0, NO_TREE].contains(tree)));
    }

    #[test]
    fn far_from_all_trees_the_search_ends_at_the_gap() {
        // One tree at a corner of 40,000 points, which lie lower than the gap lets it reach.
        let mut piece = Piece { markers: vec![marker(5, 0.0, 20.0)], ..Piece::default() };
        for i in 0..40_000 {
            let (x, y) = (f64::from(i % 200) * 0.5, f64::from(i / 200) * 0.5);
            piece.x.push(x + 2.5);
            piece.y.push(y);
            piece.z.push(5.0);
            piece.height_m.push(5.0);
            piece.is_first.push(true);
        }
        assert!(grow(&piece.view(), &LiParams::default()).iter().all(|tree| *tree == NO_TREE));
        let near = LiParams { gap_low_m: 2.5, ..LiParams::default() };
        let tree = grow(&piece.view(), &near);
        let taken = (0..tree.len()).filter(|&i| tree[i] == 0);
        let within = |i: usize| piece.x[i] * piece.x[i] + piece.y[i] * piece.y[i] <= 100.0;
        assert!(taken.clone().count() > 100 && taken.clone().all(within));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        assert!(grow(&Piece::default().view(), &LiParams::default()).is_empty());
        let piece = Piece { markers: Vec::new(), ..ridge() };
        let claims = Li { params: SegmentationParams::default() }.segment(&piece.view()).unwrap();
        assert!(claims.iter().all(|claim| *claim == Claim::default()));
    }
}
