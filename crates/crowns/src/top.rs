//! A treetop and the points that its crown is sought in.

use crate::Window;
use crate::detection::Candidate;
use crate::params::CrownModelParams;
use timberline_pointcloud::{Grid2, PointCloud};

/// A treetop, as the artefact of treetops tells it: score and cover in single precision, which
/// everything that follows from them begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Top {
    /// Tree id.
    pub id: u64,
    /// Position of the apex in the world, m.
    pub apex_m: [f64; 3],
    /// Height of the apex above ground, m.
    pub height_m: f64,
    /// Probability that it is the top of a tree, by the points right around it.
    pub score: f32,
    /// Height of what hangs over it, m; 0 where nothing does.
    pub cover_m: f32,
}

impl Top {
    /// The points that its crown model looks at. `height_m` (above ground) and `grid` (of easting
    /// and northing) are those of the cloud; a return number of 0 (not recorded) counts as first.
    #[must_use]
    pub fn window(
        &self,
        cloud: &PointCloud,
        height_m: &[f32],
        grid: &Grid2,
        params: &CrownModelParams,
    ) -> Window {
        let apex = cloud.frame.local_from_world(self.apex_m);
        let cover_m = f64::from(self.cover_m);
        let accept = |i: usize| {
            let is_first = cloud.return_number[i] <= 1;
            let wanted = params.is_seen(is_first, cloud.z[i] - apex[2], cover_m);
            wanted.then(|| f64::from(height_m[i]) >= params.min_height_m)
        };
        let half_width_m = params.half_width_m(self.height_m);
        Window::gather([&cloud.x, &cloud.y, &cloud.z], grid, apex, half_width_m, accept)
    }

    /// The candidate that it is without a crown model; positions are in the world.
    #[must_use]
    pub fn candidate(&self) -> Candidate {
        Candidate {
            id: self.id,
            apex: self.apex_m,
            height_m: self.height_m,
            score: f64::from(self.score),
            cover_m: f64::from(self.cover_m),
            coefficients: [0.0; 2],
            radius_m: 0.0,
            inliers: 0,
            outliers: 0,
            residual: 0.0,
        }
    }
}
