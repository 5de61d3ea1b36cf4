//! Segmentation in squares that are fixed in the world.
//!
//! Most segmenters let trees compete, so that in principle what is said about a point depends on the
//! whole forest. Here it depends on the world's square that holds the point, with surroundings of the
//! segmenter's reach, and on nothing else: the points and trees of that piece are the same, in the
//! same sequence and in the same frame, whatever tile they came with.

use crate::segmenter::Piece;
use crate::{Claim, Error, Marker, Segmenter, View};
use rayon::prelude::*;
use std::collections::BTreeMap;
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Frame, Grid2, Rect};

/// A square of the world: column and row, counted in edges from the origin.
type Block = [i64; 2];

/// The tree of every `wanted` point, square by square; nothing for the others. A segmenter that is
/// [`local`](Segmenter::is_local) needs no squares and is asked once for all.
///
/// `block_m` is the squares' edge in whole metres, at least 1. The view must hold all points and
/// trees within the segmenter's reach of every square with a wanted point: see [`room_m`].
///
/// # Errors
/// Those of the segmenter; [`Error::Length`] when columns, `wanted` or claims are of different
/// lengths.
pub fn segment_in_blocks(
    segmenter: &dyn Segmenter,
    view: &View<'_>,
    wanted: &[bool],
    block_m: u32,
) -> Result<Vec<Claim>, Error> {
    view.check()?;
    Error::check_lengths(view.len(), &[("wanted", wanted.len())])?;
    if segmenter.is_local() {
        return segmented_whole(segmenter, view, wanted);
    }
    let grid = Grid2::new(view.x, view.y, SEARCH_CELL_M)?;
    let blocks: Vec<(Block, Vec<u32>)> =
        wanted_by_block(view, wanted, block_m).into_iter().collect();
    let parts: Vec<Result<_, Error>> = blocks
        .par_iter()
        .map(|(block, own)| {
            let rect = rect(*block, block_m);
            let near = near(view, &grid, &rect.grown(segmenter.reach_m()));
            let piece = cut(view, &near, &rect, segmenter.reach_m());
            let claims = segmenter.segment(&piece.view())?;
            Error::check_lengths(near.len(), &[("claims", claims.len())])?;
            Ok(own_claims(own, &near, &claims))
        })
        .collect();
    let mut all = vec![Claim::default(); view.len()];
    for part in parts {
        // Of several errors always the same one.
        part?.into_iter().for_each(|(index, claim)| all[index as usize] = claim);
    }
    Ok(all)
}

/// How far beyond a rectangle of the world (whole metres) the squares that it touches reach, with
/// surroundings of `reach_m`: from `reach_m`, where the rectangle consists of whole squares, to
/// almost `block_m` more.
#[must_use]
pub fn room_m(tile: &Rect, block_m: u32, reach_m: f64) -> f64 {
    let edge = f64::from(block_m.max(1));
    let below = tile.min.map(|value| value - (value / edge).floor() * edge);
    let above = tile.max.map(|value| (value / edge).ceil() * edge - value);
    reach_m + below.into_iter().chain(above).fold(0.0, f64::max)
}

/// Edge of the search grid's cells, m.
const SEARCH_CELL_M: f64 = 8.0;

/// What a local segmenter says of the wanted points: no squares are needed.
fn segmented_whole(
    segmenter: &dyn Segmenter,
    view: &View<'_>,
    wanted: &[bool],
) -> Result<Vec<Claim>, Error> {
    let mut claims = segmenter.segment(view)?;
    Error::check_lengths(view.len(), &[("claims", claims.len())])?;
    let unwanted = claims.iter_mut().zip(wanted).filter(|(_, wanted)| !**wanted);
    unwanted.for_each(|(claim, _)| *claim = Claim::default());
    Ok(claims)
}

/// The wanted points of every square that has any.
fn wanted_by_block(view: &View<'_>, wanted: &[bool], block_m: u32) -> BTreeMap<Block, Vec<u32>> {
    let edge = i64::from(block_m.max(1));
    let mut blocks: BTreeMap<Block, Vec<u32>> = BTreeMap::new();
    for index in (0..view.len()).filter(|index| wanted[*index]) {
        let [x, y, _] = world(view, index);
        let block = [x, y].map(|value| (value.floor() as i64).div_euclid(edge));
        blocks.entry(block).or_default().push(index as u32);
    }
    blocks
}

fn rect(block: Block, block_m: u32) -> Rect {
    let edge = i64::from(block_m.max(1));
    Rect {
        min: block.map(|place| (place * edge) as f64),
        max: block.map(|place| ((place + 1) * edge) as f64),
    }
}

fn world(view: &View<'_>, index: usize) -> [f64; 3] {
    lattice(view, [view.x[index], view.y[index], view.z[index]])
}

/// World position of a lattice position, to the last bit: near the world's origin the way there and
/// back through a frame may lose it.
fn lattice(view: &View<'_>, local_m: [f64; 3]) -> [f64; 3] {
    view.frame.world_from_local(local_m).map(quantise)
}

/// Whether a position is in a rectangle, edges included.
fn within(rect: &Rect, at: [f64; 3]) -> bool {
    (0..2).all(|axis| rect.min[axis] <= at[axis] && at[axis] <= rect.max[axis])
}

/// The points in a rectangle of the world, edges included, ascending.
fn near(view: &View<'_>, grid: &Grid2, rect: &Rect) -> Vec<u32> {
    let [width, depth] = rect.size();
    let middle = [0, 1].map(|axis| (rect.min[axis] + rect.max[axis]) / 2.0);
    let local = view.frame.local_from_world([middle[0], middle[1], 0.0]);
    // A millimetre covers the rounding of the middle.
    let half = width.max(depth) / 2.0 + 1e-3;
    let mut near = Vec::new();
    grid.candidates(local[0], local[1], half, |index| {
        if within(rect, world(view, index)) {
            near.push(index as u32);
        }
    });
    near.sort_unstable();
    near
}

/// The points `near`, and the trees within `reach_m` of the square, in a frame with its origin at
/// the square's corner and at elevation 0.
fn cut(view: &View<'_>, near: &[u32], square: &Rect, reach_m: f64) -> Piece {
    let frame = Frame::new([square.min[0] as i64, square.min[1] as i64, 0]);
    let mut piece = Piece { frame, ..Piece::default() };
    for &index in near {
        let index = index as usize;
        let [x, y, z] = frame.local_from_world(world(view, index));
        piece.x.push(x);
        piece.y.push(y);
        piece.z.push(z);
        piece.height_m.push(view.height_m[index]);
        piece.is_first.push(view.is_first[index]);
    }
    let room = square.grown(reach_m);
    for marker in view.markers {
        let apex = lattice(view, marker.crown.apex);
        if within(&room, apex) {
            let mut marker = *marker;
            marker.crown.apex = frame.local_from_world(apex);
            piece.markers.push(marker);
        }
    }
    piece
}

/// The claims of `own` points; those and `near` ascend.
fn own_claims(own: &[u32], near: &[u32], claims: &[Claim]) -> Vec<(u32, Claim)> {
    let mut places = near.iter().zip(claims);
    let mut found = Vec::with_capacity(own.len());
    for &index in own {
        if let Some((_, claim)) = places.find(|(near, _)| **near == index) {
            found.push((index, *claim));
        }
    }
    found
}

/// A segmenter's trees in the sequence it may rely on.
pub fn sort_markers(markers: &mut [Marker]) {
    markers.sort_by_key(|marker| marker.crown.id);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Crown;
    use proptest::prelude::*;

    /// Says something about a point that depends on all it is shown, to the last bit.
    struct Everything {
        reach_m: f64,
    }

    impl Segmenter for Everything {
        fn reach_m(&self) -> f64 {
            self.reach_m
        }

        fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
            let mut sum = 17_u64;
            let mut mix = |bits: u64| sum = (sum.rotate_left(7) ^ bits).wrapping_mul(0x9E37_79B9);
            for i in 0..view.len() {
                [view.x[i], view.y[i], view.z[i]].iter().for_each(|v| mix(v.to_bits()));
                mix(u64::from(view.height_m[i].to_bits()) << 1 | u64::from(view.is_first[i]));
            }
            for marker in view.markers {
                marker.crown.apex.iter().for_each(|v| mix(v.to_bits()));
                mix(marker.crown.id);
            }
            let claim = |i| Claim { id: sum.wrapping_add(i as u64 + 1), score: 0.5 };
            Ok((0..view.len()).map(claim).collect())
        }
    }

    /// What falls into a rectangle, in a frame of its own.
    fn piece(points: &[(i32, i32, i32)], rect: &Rect, frame: Frame) -> (Vec<usize>, Piece) {
        let mut piece = Piece { frame, ..Piece::default() };
        let mut indices = Vec::new();
        for (i, p) in points.iter().enumerate() {
            let world =
                [p.0, p.1, p.2].map(|v| timberline_pointcloud::frame::quantise(f64::from(v) * 0.1));
            if !within(rect, world) {
                continue;
            }
            let apex = frame.local_from_world(world);
            indices.push(i);
            piece.x.push(apex[0]);
            piece.y.push(apex[1]);
            piece.z.push(apex[2]);
            piece.height_m.push(p.2 as f32);
            piece.is_first.push(p.2 % 2 == 0);
            if i % 3 == 0 {
                let (coefficients, tolerance_m) = ([0.0; 2], 0.5);
                let crown = Crown {
                    id: i as u64 + 1,
                    apex,
                    coefficients,
                    radius_m: 1.0,
                    tolerance_m,
                    oblique: false,
                };
                piece.markers.push(Marker { crown, height_m: 1.0, score: 1.0 });
            }
        }
        (indices, piece)
    }

    /// The claims of all points, tile by tile, each with no more room than it needs.
    fn in_tiles(
        points: &[(i32, i32, i32)],
        tile_m: i64,
        shift: i64,
        block_m: u32,
        reach_m: f64,
    ) -> Vec<Claim> {
        let mut all = vec![Claim::default(); points.len()];
        for column in -8..8 {
            for row in -8..8 {
                let corner = [column * tile_m + shift, row * tile_m - shift];
                let tile = Rect {
                    min: corner.map(|v| v as f64),
                    max: corner.map(|v| (v + tile_m) as f64),
                };
                let room = tile.grown(room_m(&tile, block_m, reach_m));
                let (indices, piece) =
                    piece(points, &room, Frame::new([corner[0], corner[1], row]));
                let view = piece.view();
                let own: Vec<bool> = (0..view.len())
                    .map(|i| {
                        let [x, y, _] = world(&view, i);
                        tile.contains(x, y)
                    })
                    .collect();
                let claims =
                    segment_in_blocks(&Everything { reach_m }, &view, &own, block_m).unwrap();
                for (place, index) in indices.into_iter().enumerate() {
                    if own[place] {
                        all[index] = claims[place];
                    } else {
                        assert_eq!(claims[place], Claim::default());
                    }
                }
            }
        }
        all
    }

    proptest! {
        #[test]
        fn claims_depend_on_the_world_square_only(
            points in prop::collection::vec((-300i32..300, -300i32..300, 0i32..100), 1..80),
            tile_m in 8i64..40, shift in 0i64..40, block_m in 8u32..40, reach in 0u8..40,
        ) {
            let reach_m = f64::from(reach) * 0.5;
            let expected = in_tiles(&points, 64, 0, block_m, reach_m);
            prop_assert!(expected.iter().all(|claim| claim.id != 0));
            prop_assert_eq!(&in_tiles(&points, tile_m, shift % tile_m, block_m, reach_m), &expected);
        }
    }

    /// Says for every point how many it was shown.
    struct Count {
        is_local: bool,
    }

    impl Segmenter for Count {
        fn reach_m(&self) -> f64 {
            1.0
        }

        fn is_local(&self) -> bool {
            self.is_local
        }

        fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
            Ok(vec![Claim { id: view.len() as u64, score: 0.5 }; view.len()])
        }
    }

    #[test]
    fn local_segmenters_are_asked_once_and_for_wanted_points_only() {
        let rect = Rect { min: [-99.0; 2], max: [99.0; 2] };
        let (_, piece) = piece(&[(0, 0, 0), (10, 10, 0), (800, 800, 0)], &rect, Frame::default());
        let ids = |is_local| {
            let wanted = [true, false, true];
            let claims = segment_in_blocks(&Count { is_local }, &piece.view(), &wanted, 8).unwrap();
            claims.iter().map(|claim| claim.id).collect::<Vec<u64>>()
        };
        assert_eq!((ids(true), ids(false)), (vec![3, 0, 3], vec![2, 0, 1]));
    }

    #[test]
    fn room_is_the_reach_where_squares_fit() {
        let tile = Rect { min: [128.0, -64.0], max: [192.0, 0.0] };
        assert_eq!(room_m(&tile, 64, 9.0), 9.0);
        assert_eq!(room_m(&tile, 32, 9.0), 9.0);
        assert_eq!(room_m(&tile.moved([1.0, 0.0]), 64, 9.0), 9.0 + 63.0);
    }

    #[test]
    fn columns_of_different_lengths_are_an_error() {
        let (_, piece) = piece(
            &[(0, 0, 0), (1, 1, 1)],
            &Rect { min: [-9.0; 2], max: [9.0; 2] },
            Frame::default(),
        );
        let view = piece.view();
        let short = segment_in_blocks(&Everything { reach_m: 1.0 }, &view, &[true], 8).unwrap_err();
        assert_eq!(short, Error::Length { column: "wanted", expected: 2, found: 1 });
        let short = View { is_first: &[], ..view };
        let short =
            segment_in_blocks(&Everything { reach_m: 1.0 }, &short, &[true; 2], 8).unwrap_err();
        assert_eq!(short, Error::Length { column: "first return", expected: 2, found: 0 });
    }
}
