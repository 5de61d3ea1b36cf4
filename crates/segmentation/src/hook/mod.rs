//! Segmentation by a program of the user's.
//!
//! The program is given a tile with its surroundings as `in.laz` and the trees as `tops.csv`, in a
//! folder of its own, and leaves the tree of every point as `out.laz` or `out.csv`; the contract is
//! in `pipelines/hooks/README.md`. Nothing it does is trusted: it has a time and a memory limit, it
//! and everything it started is gone when [`segment`] returns, and its answer is checked point by
//! point. What it said is handed on, whatever became of it.
//!
//! This is the only place in the crate that touches files, processes and the clock.

mod command;
mod failure;
mod family;
mod give;
mod layout;
mod run;
mod said;
mod take;

pub use command::{named_files, resolve};
pub use failure::Failure;
pub use run::Limits;

use crate::surface::surface_scores;
use crate::{Claim, Marker};
use std::path::Path;
use timberline_artefact::Crs;
use timberline_pointcloud::PointCloud;

/// What a program is to segment.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The points of a tile and of its surroundings.
    pub cloud: &'a PointCloud,
    /// Height above ground, m; NaN where unknown.
    pub height_m: &'a [f32],
    /// Whether a point is ground.
    pub is_ground: &'a [bool],
    /// Whether a point is the tile's own.
    pub own: &'a [bool],
    /// The trees, in the frame of the points, sorted by id.
    pub markers: &'a [Marker],
    /// Farthest that those who read the answer expect a point from the top of its tree, in the plane, m.
    pub reach_m: f64,
    /// The system in which the program gets its coordinates.
    pub crs: &'a Crs,
}

/// How a program is run.
#[derive(Debug)]
pub struct Program<'a> {
    /// Program and arguments; files by absolute paths, see [`resolve`].
    pub command: &'a [String],
    /// As the user wrote it, for messages.
    pub title: &'a str,
    /// Further environment variables.
    pub environment: &'a [(&'static str, String)],
    /// What it may take.
    pub limits: Limits,
    /// A folder of its own.
    pub folder: &'a Path,
}

/// The tree of every point as a program sees it, but none for points further than `reach_m` from
/// the top of theirs.
///
/// `cancelled` is asked many times a second; `log` is given what the program said, also when it
/// failed, and then how many points were too far away, if any were.
///
/// # Errors
/// [`Failure`].
pub fn segment(
    request: &Request<'_>,
    program: &Program<'_>,
    cancelled: &dyn Fn() -> bool,
    log: &mut dyn FnMut(String),
) -> Result<Vec<Claim>, Failure> {
    give::points(request, &program.folder.join(give::POINTS))?;
    give::tops(request, &program.folder.join(give::TOPS))?;
    run::run(program, cancelled, log)?;
    let mut answer = take::take(program.folder, request)?;
    let far = drop_far(request, &mut answer.tree_id);
    if far > 0 {
        log(format!(
            "{far} points farther than reach_m = {} m from the top of their tree got none",
            request.reach_m
        ));
    }
    Ok(claims(request, answer))
}

/// Takes their tree from points that are too far from its top; their number.
fn drop_far(request: &Request<'_>, tree_id: &mut [u64]) -> usize {
    let (cloud, squared_m2) = (request.cloud, request.reach_m * request.reach_m);
    let mut far = 0;
    for (index, id) in tree_id.iter_mut().enumerate() {
        let Ok(at) = request.markers.binary_search_by_key(id, |marker| marker.crown.id) else {
            continue;
        };
        let [x, y, _] = request.markers[at].crown.apex;
        let (dx, dy) = (cloud.x[index] - x, cloud.y[index] - y);
        if dx * dx + dy * dy > squared_m2 {
            *id = 0;
            far += 1;
        }
    }
    far
}

/// What a program answered, checked.
#[derive(Debug, Clone, PartialEq, Default)]
struct Answer {
    /// The tree of every point, 0 for none.
    tree_id: Vec<u64>,
    /// The score of every point, where the program gives one.
    score: Option<Vec<f32>>,
}

fn claims(request: &Request<'_>, answer: Answer) -> Vec<Claim> {
    let cloud = request.cloud;
    let score = answer
        .score
        .unwrap_or_else(|| surface_scores([&cloud.x, &cloud.y, &cloud.z], &answer.tree_id));
    let claim = |(id, score): (u64, f32)| match id {
        0 => Claim::default(),
        id => Claim { id, score },
    };
    answer.tree_id.into_iter().zip(score).map(claim).collect()
}

#[cfg(test)]
mod tests;
