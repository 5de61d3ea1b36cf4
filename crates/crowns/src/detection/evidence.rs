//! What a crown model and its rivals say about a candidate.

use super::Candidate;

/// Number of values.
pub const LEN: usize = 13;

/// The values: see [`evidence`].
pub type Evidence = [f64; LEN];

/// What an outlier takes from a model's gain, an inlier adding 1: the default of the parameter
/// `outlier_cost` of the crown models.
const OUTLIER_COST: f64 = 0.35;
/// A candidate this far from a rival's surface is hardly of it, m.
const ON_SURFACE_M: f64 = 1.5;
/// Scores nearer to 0 or 1 say no more.
const SUREST: f64 = 1e-4;

/// What speaks for and against a candidate, given its rivals with their distances.
#[must_use]
pub fn evidence(own: &Candidate, rivals: &[(&Candidate, f64)]) -> Evidence {
    let odds = own.score.clamp(SUREST, 1.0 - SUREST);
    let gain = f64::from(own.inliers) - OUTLIER_COST * f64::from(own.outliers);
    let points = f64::from(own.inliers + own.outliers).max(1.0);
    let [on_higher, below_higher] = explained(own, rivals);
    [
        libm::log(odds / (1.0 - odds)),
        libm::log(own.height_m.max(1.0)),
        libm::log1p(own.radius_m),
        libm::log1p(gain.max(0.0)),
        f64::from(own.outliers) / points,
        own.residual,
        libm::log1p(own.cover_m),
        on_higher,
        below_higher,
        explains(own, rivals),
        libm::log(distance_to(own, rivals, |rival| rival.apex[2] > own.apex[2])),
        libm::log(distance_to(own, rivals, |rival| rival.score > own.score)),
        libm::log1p(slope(own)),
    ]
}

/// How nearly an apex lies on the surface of a model (1 on it, towards 0 away from it), and how
/// far below it (at most 10 m); none beyond the model's radius.
fn on_surface(apex: &[f64; 3], model: &Candidate, distance: f64) -> Option<[f64; 2]> {
    let [b1, b2] = model.coefficients;
    let depth = model.apex[2] - distance * (b1 + b2 * distance) - apex[2];
    let nearness = ON_SURFACE_M / (ON_SURFACE_M + depth.abs());
    (distance < model.radius_m).then_some([nearness, depth.clamp(0.0, 10.0)])
}

/// How nearly the candidate lies on the surface of a higher rival, and how far below one, each
/// weighted by the rival's score.
fn explained(own: &Candidate, rivals: &[(&Candidate, f64)]) -> [f64; 2] {
    let higher = rivals.iter().filter(|(rival, _)| rival.apex[2] > own.apex[2]);
    higher.fold([0.0; 2], |best, (rival, distance)| {
        let Some([nearness, depth]) = on_surface(&own.apex, rival, *distance) else { return best };
        [best[0].max(rival.score * nearness), best[1].max(rival.score * depth)]
    })
}

/// The sum of the scores of lower rivals, each as nearly as it lies on the candidate's surface.
fn explains(own: &Candidate, rivals: &[(&Candidate, f64)]) -> f64 {
    let lower = rivals.iter().filter(|(rival, _)| rival.apex[2] < own.apex[2]);
    let share = |(rival, distance): &(&Candidate, f64)| {
        on_surface(&rival.apex, own, *distance).map_or(0.0, |[near, _]| rival.score * near)
    };
    libm::log1p(lower.map(share).sum())
}

/// Distance to the nearest rival of a sort; 20 m without one, at least 0.3 m.
fn distance_to(
    own: &Candidate,
    rivals: &[(&Candidate, f64)],
    sort: impl Fn(&Candidate) -> bool,
) -> f64 {
    let level = |rival: &Candidate| rival.apex[2] > own.apex[2] - own.height_m;
    let wanted = rivals.iter().filter(|(rival, _)| level(rival) && sort(rival));
    wanted.map(|(_, distance)| distance.max(0.3)).fold(20.0, f64::min)
}

/// Mean slope of the model's surface from the apex to the radius.
fn slope(own: &Candidate) -> f64 {
    let [b1, b2] = own.coefficients;
    (b1 + b2 * own.radius_m).clamp(0.0, 20.0)
}
