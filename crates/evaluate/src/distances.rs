//! Distances between points and models, and between two models.

use crate::Error;
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Nearest3;
use timberline_solids::sampling::{Sample, on_cylinders, on_mesh};
use timberline_solids::{Cylinder, CylinderIndex, DistanceSummary, Ends, Mesh, MeshIndex};

/// The cylinders of a model and the ends that are part of its surface, see
/// [`timberline_solids::free_ends`].
#[derive(Debug, Clone, Copy)]
pub struct CylinderModel<'a> {
    /// The cylinders.
    pub cylinders: &'a [Cylinder],
    /// Their ends; those that are missing are closed.
    pub ends: &'a [Ends],
}

impl CylinderModel<'_> {
    fn index(&self) -> CylinderIndex {
        CylinderIndex::with_ends(self.cylinders, self.ends)
    }

    /// Positions on the surface that can be seen from outside, about one in every square of
    /// `spacing_m`.
    fn surface(&self, spacing_m: f64) -> Vec<[f64; 3]> {
        positions(&on_cylinders(self.cylinders, self.ends, spacing_m))
    }
}

fn positions(samples: &[Sample]) -> Vec<[f64; 3]> {
    samples.iter().map(|sample| sample.position_m).collect()
}

/// Distances both ways. Neither alone means much: a model with very many branches is near every point,
/// and one with very few is near some point everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct BothWays {
    /// From the first to the second: from the points or the assessed model.
    pub forth: DistanceSummary,
    /// From the second to the first: from the model's or the reference's surface.
    pub back: DistanceSummary,
}

/// Distances from every point to the nearest surface of a cylinder, and from positions on the surface of
/// the cylinders to the nearest point.
///
/// # Errors
/// [`Error::Parameter`] for a spacing that is not positive, [`Error::Search`].
pub fn points_and_cylinders(
    points_m: &[[f64; 3]],
    model: &CylinderModel<'_>,
    spacing_m: f64,
) -> Result<BothWays, Error> {
    check_spacing(spacing_m)?;
    let index = model.index();
    let mut forth = found(index.nearest_all(points_m));
    let back = to_points(&model.surface(spacing_m), points_m)?;
    Ok(BothWays { forth: DistanceSummary::of(&mut forth), back })
}

/// The same for a mesh.
///
/// # Errors
/// As [`points_and_cylinders`].
pub fn points_and_mesh(
    points_m: &[[f64; 3]],
    mesh: &Mesh,
    spacing_m: f64,
) -> Result<BothWays, Error> {
    check_spacing(spacing_m)?;
    let mut forth = found(MeshIndex::new(mesh).nearest_all(points_m));
    let back = to_points(&positions(&on_mesh(mesh, spacing_m)), points_m)?;
    Ok(BothWays { forth: DistanceSummary::of(&mut forth), back })
}

/// Distances from the surface of a model to that of a reference, and back.
///
/// # Errors
/// [`Error::Parameter`] for a spacing that is not positive.
pub fn between_models(
    model: &CylinderModel<'_>,
    reference: &CylinderModel<'_>,
    spacing_m: f64,
) -> Result<BothWays, Error> {
    let forth = from_surface(model, reference, spacing_m)?;
    Ok(BothWays { forth, back: from_surface(reference, model, spacing_m)? })
}

/// Distances from the surface of one model to that of another.
///
/// # Errors
/// [`Error::Parameter`] for a spacing that is not positive.
pub fn from_surface(
    from: &CylinderModel<'_>,
    to: &CylinderModel<'_>,
    spacing_m: f64,
) -> Result<DistanceSummary, Error> {
    check_spacing(spacing_m)?;
    Ok(DistanceSummary::of(&mut found(to.index().nearest_all(&from.surface(spacing_m)))))
}

/// Distances from positions to the nearest point.
///
/// # Errors
/// [`Error::Search`].
pub fn to_points(
    positions_m: &[[f64; 3]],
    points_m: &[[f64; 3]],
) -> Result<DistanceSummary, Error> {
    let is_finite = |p: &&[f64; 3]| p.iter().all(|value| value.is_finite());
    let points: Vec<[f64; 3]> = points_m.iter().filter(is_finite).copied().collect();
    let search = Nearest3::new(&points)?;
    let nearest = |position: &[f64; 3]| search.nearest(position, 1).first().map(|n| n.squared_m2);
    let squared = positions_m.iter().filter(is_finite).filter_map(nearest);
    Ok(DistanceSummary::of(&mut squared.map(f64::sqrt).collect()))
}

/// What MeshLab's filter "Hausdorff distance" tells (Cignoni, Rocchini and Scopigno 1998, Metro): one-sided
/// distances from samples of one thing to the surface of another.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Hausdorff {
    /// Number of samples.
    pub samples: u64,
    /// Smallest distance, m.
    pub min_m: f64,
    /// Largest distance, m: the one-sided Hausdorff distance.
    pub max_m: f64,
    /// Mean, m.
    pub mean_m: f64,
    /// Root of the mean square, m.
    pub rms_m: f64,
    /// Diagonal of the samples' bounding box, m, to which MeshLab relates the others.
    pub diagonal_m: f64,
}

/// One-sided distances from samples (the points of a cloud, the vertices of a mesh) to the surface of a
/// mesh. Of no samples or no surface all is 0.
#[must_use]
pub fn hausdorff(samples_m: &[[f64; 3]], mesh: &Mesh) -> Hausdorff {
    of_distances(samples_m, found(MeshIndex::new(mesh).nearest_all(samples_m)))
}

/// The same to the surface of cylinders.
#[must_use]
pub fn hausdorff_to_cylinders(samples_m: &[[f64; 3]], model: &CylinderModel<'_>) -> Hausdorff {
    of_distances(samples_m, found(model.index().nearest_all(samples_m)))
}

fn of_distances(samples_m: &[[f64; 3]], mut distances: Vec<f64>) -> Hausdorff {
    let summary = DistanceSummary::of(&mut distances);
    let mut squared = 0.0;
    for axis in 0..3 {
        let values = || samples_m.iter().map(|p| p[axis]).filter(|value| value.is_finite());
        let size =
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        squared += if size.is_finite() { size * size } else { 0.0 };
    }
    Hausdorff {
        samples: summary.count,
        min_m: distances.first().copied().unwrap_or(0.0),
        max_m: summary.max_m,
        mean_m: summary.mean_m,
        rms_m: summary.rms_m,
        diagonal_m: squared.sqrt(),
    }
}

fn found(nearest: Vec<Option<(u32, f64)>>) -> Vec<f64> {
    nearest.into_iter().flatten().map(|(_, distance_m)| distance_m).collect()
}

fn check_spacing(spacing_m: f64) -> Result<(), Error> {
    if spacing_m > 0.0 && spacing_m.is_finite() {
        return Ok(());
    }
    Err(Error::Parameter { name: "spacing_m", value: spacing_m, allowed: "it must be above 0 m" })
}

#[cfg(test)]
mod tests {
    use super::*;

    const POST: Cylinder = Cylinder { start_m: [0.0; 3], end_m: [0.0, 0.0, 2.0], radius_m: 0.25 };
    const OPEN: [Ends; 1] = [Ends::NONE];

    fn post(radius_m: f64) -> [Cylinder; 1] {
        [Cylinder { radius_m, ..POST }]
    }

    /// Points around the post, `off` beyond its surface.
    fn around(off: f64) -> Vec<[f64; 3]> {
        let place = |i: i32| {
            let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
            let reach = POST.radius_m + off;
            [reach * cos, reach * sin, f64::from(i) / 2000.0 * 2.0]
        };
        (0..2000).map(place).collect()
    }

    #[test]
    fn points_off_by_a_centimetre_are_a_centimetre_away() {
        let model = CylinderModel { cylinders: &[POST], ends: &OPEN };
        let found = points_and_cylinders(&around(0.01), &model, 0.02).unwrap();
        for value in [found.forth.mean_m, found.forth.rms_m, found.forth.p95_m, found.forth.max_m] {
            assert!((value - 0.01).abs() < 1e-9, "{value}");
        }
        assert_eq!(found.forth.count, 2000);
        // Back it is the gap between points that counts.
        assert!(found.back.count > 7000 && found.back.mean_m < 0.03);
    }

    #[test]
    fn half_a_tree_is_near_one_way_only() {
        let half = [Cylinder { end_m: [0.0, 0.0, 1.0], ..POST }];
        let model = CylinderModel { cylinders: &half, ends: &OPEN };
        let reference = CylinderModel { cylinders: &[POST], ends: &OPEN };
        let found = between_models(&model, &reference, 0.02).unwrap();
        assert!(found.forth.max_m < 1e-9);
        assert!((found.back.max_m - 1.0).abs() < 0.02 && (found.back.mean_m - 0.25).abs() < 0.01);
    }

    #[test]
    fn a_mesh_and_its_cylinder_agree() {
        let tube = timberline_solids::tubes::tube(
            &post(0.25),
            timberline_solids::tubes::Fineness { sides: 64, step_m: 0.1 },
        );
        let model = CylinderModel { cylinders: &[POST], ends: &[Ends::BOTH] };
        let points = around(0.03);
        let by_mesh = points_and_mesh(&points, &tube.mesh, 0.02).unwrap();
        let by_cylinder = points_and_cylinders(&points, &model, 0.02).unwrap();
        assert!((by_mesh.forth.mean_m - by_cylinder.forth.mean_m).abs() < 5e-4);
        let meshlab = hausdorff(&tube.mesh.vertices_m, &tube.mesh);
        assert_eq!(meshlab.samples, tube.mesh.vertices_m.len() as u64);
        assert!(meshlab.max_m < 1e-12);
        let far = hausdorff_to_cylinders(&points, &model);
        assert!((far.min_m - 0.03).abs() < 1e-9 && (far.diagonal_m - 2.15).abs() < 0.02, "{far:?}");
    }

    #[test]
    fn nothing_and_nonsense() {
        let model = CylinderModel { cylinders: &[], ends: &[] };
        assert_eq!(points_and_cylinders(&around(0.0), &model, 0.1).unwrap(), BothWays::default());
        let lost = points_and_cylinders(
            &[[f64::NAN; 3]],
            &CylinderModel { cylinders: &[POST], ends: &[] },
            0.1,
        );
        assert_eq!(lost.unwrap(), BothWays::default());
        for spacing in [0.0, -1.0, f64::NAN] {
            assert!(matches!(
                points_and_cylinders(&[], &model, spacing),
                Err(Error::Parameter { .. })
            ));
        }
        assert_eq!(hausdorff(&[], &Mesh::default()), Hausdorff::default());
    }
}
