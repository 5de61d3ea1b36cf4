//! Of candidates close to one another the best stands.

use crate::input::Ranked;
use crate::{Candidate, Error};
use rayon::prelude::*;
use timberline_pointcloud::{Grid2, order};

/// Nearer than this in the plane two treetops could have the same tree id, whatever their
/// elevations, m.
const SMALLEST_APART_M: f64 = 0.3;

/// The candidates that no better one is close to, with their scores.
///
/// Whether a candidate stands is asked of all others alike, standing or not, so that it depends on
/// its surroundings only. Of equal scores the first in canonical order is better.
pub(crate) fn keep(
    ranked: &Ranked<'_>,
    scored: Vec<(Candidate, f64)>,
) -> Result<Vec<(Candidate, f64)>, Error> {
    let (cloud, params) = (ranked.input.cloud, ranked.params);
    let column = |values: &[f64]| scored.iter().map(|(c, _)| values[c.index as usize]).collect();
    let (x, y): (Vec<f64>, Vec<f64>) = (column(&cloud.x), column(&cloud.y));
    let grid = Grid2::new(&x, &y, 2.0).map_err(Error::Grid)?;
    let stands = |place: &usize| {
        let (own, score) = &scored[*place];
        let index = own.index as usize;
        let height_m = ranked.height(index);
        let reach = (params.apart_m + params.apart_per_height * height_m).max(SMALLEST_APART_M);
        let vertical = params.apart_vertical_m + params.apart_vertical_per_height * height_m;
        let mut stands = true;
        grid.candidates(x[*place], y[*place], reach, |other| {
            let (dx, dy) = (x[other] - x[*place], y[other] - y[*place]);
            if stands && other != *place && dx * dx + dy * dy <= reach * reach {
                let (rival, rival_score) = &scored[other];
                let rival = rival.index as usize;
                let same_id = dx * dx + dy * dy <= SMALLEST_APART_M * SMALLEST_APART_M;
                let level = same_id || (cloud.z[rival] - cloud.z[index]).abs() <= vertical;
                let first = || order::compare(cloud, rival, index).then(rival.cmp(&index)).is_lt();
                let better = rival_score > score || (rival_score == score && first());
                stands = !(level && better);
            }
        });
        stands
    };
    let kept: Vec<bool> = (0..scored.len()).into_par_iter().map(|place| stands(&place)).collect();
    Ok(scored.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(one, _)| one).collect())
}
