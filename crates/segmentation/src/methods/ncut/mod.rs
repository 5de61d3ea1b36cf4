//! Normalized cut of a graph of voxels (Reitberger, Schnörr, Krzystek and Stilla 2009, 3D
//! segmentation of single trees exploiting full waveform LIDAR data, ISPRS J. 64: 561-574; the
//! method is that of Shi and Malik 2000, Normalized cuts and image segmentation, IEEE PAMI 22).
//!
//! Voxels are alike when they are near in the plane, not too different in height and both near a
//! treetop. The graph is cut in two where the cut costs least compared with what either side is
//! worth, and so on, until the best cut is worth more than a fixed threshold.
//!
//! Weights fall off within some metres, so the graph is sparse; it is cut square by square
//! ([`crate::blocks`]), so the cost grows with the area. The eigenvectors are those of [`eigen`].

pub mod cut;
mod divide;
pub mod eigen;
pub mod graph;
mod segmenter;
mod voxels;

pub use graph::Graph;
pub use segmenter::{Ncut, trees};

use crate::{SegmentationParams, View};
use divide::Whole;
use voxels::{Voxels, gauss};

/// Parameters of the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NcutParams {
    /// Edge of a voxel in the plane, m.
    pub voxel_m: f64,
    /// Its height, m.
    pub voxel_height_m: f64,
    /// Voxels further apart in the plane have no edge, m.
    pub radius_m: f64,
    /// Scale on which likeness falls off in the plane, m.
    pub sigma_xy_m: f64,
    /// In height, m.
    pub sigma_z_m: f64,
    /// With the distance from the nearest top in the plane, m.
    pub sigma_top_m: f64,
    /// A cut that is worth more is not made.
    pub most_ncut: f64,
    /// Fewest voxels of a tree.
    pub min_voxels: usize,
    /// Lowest point of a tree, m.
    pub min_height_m: f64,
}

impl NcutParams {
    /// Those named `ncut_` among the parameters of the stage.
    #[must_use]
    pub fn of(params: &SegmentationParams) -> Self {
        Self {
            voxel_m: params.ncut_voxel_m,
            voxel_height_m: params.ncut_voxel_height_m,
            radius_m: params.ncut_radius_m,
            sigma_xy_m: params.ncut_sigma_xy_m,
            sigma_z_m: params.ncut_sigma_z_m,
            sigma_top_m: params.ncut_sigma_top_m,
            most_ncut: params.ncut_threshold,
            min_voxels: params.ncut_min_voxels as usize,
            min_height_m: params.min_height_m,
        }
    }
}

/// A treetop: known, or supposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Top {
    /// Position in the plane, in the frame of the points.
    pub at: [f64; 2],
    /// Height above ground, m.
    pub height_m: f64,
}

/// The part of every point, by its highest top, or `u32::MAX`.
///
/// With `given` tops each is a tree: a part with several is cut whatever it costs, so that each has
/// one, and a part without any is no tree. Otherwise tops only say what is likely, and the parts are
/// numbered from 0 in no particular sequence.
#[must_use]
pub fn parts(view: &View<'_>, tops: &[Top], given: bool, params: &NcutParams) -> Vec<u32> {
    let voxels = Voxels::new(view, params);
    let centres = voxels.centres(view, params);
    let nearness = nearness(&centres, tops, params);
    let graph = voxels.graph(&nearness, params);
    let top_voxels: Vec<Option<u32>> =
        tops.iter().map(|top| voxels.at(view, top, params)).collect();
    let mut counts = vec![0; voxels.cells.len()];
    top_voxels.iter().flatten().for_each(|voxel| counts[*voxel as usize] += 1);
    // Not constant in any piece, nor symmetric where a piece may be.
    let start: Vec<f64> = centres.iter().map(|[x, y]| x + 0.618 * y + 0.01 * x * y).collect();
    let whole = Whole { graph: &graph, tops: &counts, start: &start, given, params };
    let parts = whole.parts();
    let mut part_of = vec![u32::MAX; voxels.cells.len()];
    for (part, number) in parts.iter().zip(0..) {
        part.iter().for_each(|voxel| part_of[*voxel as usize] = number);
    }
    let names = if given {
        names(tops, &top_voxels, &part_of, parts.len())
    } else {
        (0..).take(parts.len()).collect()
    };
    let name = |voxel: &u32| {
        let part = part_of.get(*voxel as usize).copied().unwrap_or(u32::MAX);
        names.get(part as usize).copied().unwrap_or(u32::MAX)
    };
    voxels.of_point.iter().map(name).collect()
}

/// The highest top of every part, of equal ones the first.
fn names(tops: &[Top], voxels: &[Option<u32>], part_of: &[u32], parts: usize) -> Vec<u32> {
    let mut names = vec![u32::MAX; parts];
    for (top, voxel) in voxels.iter().enumerate() {
        let Some(voxel) = voxel else { continue };
        let name = &mut names[part_of[*voxel as usize] as usize];
        let higher = tops.get(*name as usize).is_none_or(|t| t.height_m < tops[top].height_m);
        if higher {
            *name = top as u32;
        }
    }
    names
}

/// How near every voxel is to the nearest top in the plane: exp(-(d/s)²), from 0 to 1.
fn nearness(centres: &[[f64; 2]], tops: &[Top], params: &NcutParams) -> Vec<f64> {
    let positions: Vec<[f64; 2]> = tops.iter().map(|top| top.at).collect();
    let Ok(tree) = timberline_pointcloud::Nearest2::new(&positions) else {
        return vec![1.0; centres.len()];
    };
    let near = |centre: &[f64; 2]| {
        let far = FARTHEST_SCALES * params.sigma_top_m;
        let distance = tree.nearest(centre, 1).first().map_or(far, |n| n.squared_m2.sqrt());
        gauss(distance.min(far), params.sigma_top_m)
    };
    centres.iter().map(near).collect()
}

/// Distances beyond this many scales count as this many, so that no weight vanishes.
const FARTHEST_SCALES: f64 = 3.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Piece;

    /// Two cones whose flanks meet, tops 6 m apart.
    fn cones() -> (Piece, [Top; 2]) {
        let mut piece = Piece::default();
        for i in -12..=36 {
            for j in -12..=12 {
                let [x, y] = [i, j].map(|place| 0.25 * f64::from(place));
                let depth = |top: f64| 2.0 * libm::hypot(x - top, y);
                let surface = f64::max(20.0 - depth(0.0), 18.0 - depth(6.0));
                for below in [0.0, 1.5, 3.0] {
                    piece.x.push(x);
                    piece.y.push(y);
                    piece.z.push(surface - below);
                    piece.height_m.push((surface - below) as f32);
                    piece.is_first.push(below == 0.0);
                }
            }
        }
        let tops = [([0.0; 2], 20.0), ([6.0, 0.0], 18.0)];
        (piece, tops.map(|(at, height_m)| Top { at, height_m }))
    }

    /// Share of points that have the number of the cone they are of.
    fn right(piece: &Piece, parts: &[u32]) -> f64 {
        let nearer = |i: &usize| {
            u32::from(
                20.0 - 2.0 * libm::hypot(piece.x[*i], piece.y[*i])
                    < 18.0 - 2.0 * libm::hypot(piece.x[*i] - 6.0, piece.y[*i]),
            )
        };
        let right = (0..parts.len()).filter(|i| parts[*i] == nearer(i)).count();
        right as f64 / parts.len() as f64
    }

    #[test]
    fn each_given_tree_has_its_cone() {
        let (piece, tops) = cones();
        let params = NcutParams::of(&SegmentationParams::default());
        let found = parts(&piece.view(), &tops, true, &params);
        assert!(right(&piece, &found) > 0.93, "{}", right(&piece, &found));
        let strict = NcutParams { most_ncut: 0.0, ..params };
        let one = parts(&piece.view(), &tops[..1], true, &strict);
        assert!(one.iter().all(|part| *part == 0), "nothing to cut");
        assert!(parts(&piece.view(), &[], true, &params).iter().all(|part| *part == u32::MAX));
    }

    #[test]
    fn tops_above_all_points_have_their_cones_as_well() {
        let (piece, tops) = cones();
        let params = NcutParams::of(&SegmentationParams::default());
        let raised = tops.map(|top| Top { height_m: top.height_m + 1.2, ..top });
        assert_eq!(
            parts(&piece.view(), &raised, true, &params),
            parts(&piece.view(), &tops, true, &params)
        );
    }

    #[test]
    fn the_threshold_decides_where_no_tree_is_given() {
        let (piece, tops) = cones();
        let number = |most_ncut: f64| {
            let params = NcutParams { most_ncut, ..NcutParams::of(&SegmentationParams::default()) };
            parts(&piece.view(), &tops, false, &params).into_iter().max().map_or(0, |most| most + 1)
        };
        assert_eq!(number(0.0), 1);
        assert_eq!(number(0.16), 2);
        assert!(number(0.8) > 2);
    }

    #[test]
    fn points_below_the_least_height_are_left_out() {
        let (piece, tops) = cones();
        let params =
            NcutParams { min_height_m: 15.0, ..NcutParams::of(&SegmentationParams::default()) };
        let found = parts(&piece.view(), &tops, true, &params);
        assert!((0..found.len()).all(|i| (found[i] == u32::MAX) == (piece.height_m[i] < 15.0)));
    }
}
