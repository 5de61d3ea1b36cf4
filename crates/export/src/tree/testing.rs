//! A small tree with known numbers.

use timberline_artefact::kinds::{
    BaseSource, ConsolidationEffect, Dbh, Distances, Qsm, QsmBranch, QsmCylinder, RadiusSource,
    TaperStep, TreeMetrics,
};
use timberline_pointcloud::Frame;

/// Where it stands.
pub(crate) const FRAME: Frame = Frame::new([500_000, 5_000_000, 1_000]);

fn cylinder(start_m: [f64; 3], end_m: [f64; 3], radius_m: f64, parent: Option<u32>) -> QsmCylinder {
    QsmCylinder {
        start_m,
        end_m,
        radius_m,
        radius_sd_m: 0.002,
        source: RadiusSource::Measured,
        arc_coverage: 0.75,
        points: 100,
        parent,
        branch: 0,
    }
}

/// A stem of three cylinders and a branch of one.
pub(crate) fn fork(tree_id: u64) -> Qsm {
    let mut cylinders = vec![
        cylinder([0.5, 0.5, 0.0], [0.5, 0.5, 2.0], 0.2, None),
        cylinder([0.5, 0.5, 2.0], [0.5, 0.6, 4.0], 0.15, Some(0)),
        cylinder([0.5, 0.6, 4.0], [0.6, 0.6, 6.0], 0.1, Some(1)),
        cylinder([0.5, 0.6, 4.0], [2.0, 0.6, 5.0], 0.05, Some(1)),
    ];
    cylinders[2].source = RadiusSource::Interpolated;
    let inferred = &mut cylinders[3];
    (inferred.branch, inferred.source) = (1, RadiusSource::Inferred);
    (inferred.radius_sd_m, inferred.points, inferred.arc_coverage) = (f64::NAN, 0, 0.0);
    let [stem, branch] = [(None, 0, 0, 3), (Some(0), 1, 3, 1)]
        .map(|(parent, order, first, len)| QsmBranch { parent, order, first, len });
    let step =
        |height_m, diameter_m| TaperStep { height_m, diameter_m, source: RadiusSource::Measured };
    Qsm {
        tree_id,
        base_m: FRAME.world_from_local([0.5, 0.5, 0.0]),
        base_source: BaseSource::Ground,
        cylinders,
        branches: vec![stem, branch],
        metrics: TreeMetrics {
            dbh: Some(Dbh {
                diameter_m: 0.4,
                sd_m: 0.004,
                arc_coverage: 0.75,
                points: 100,
                source: RadiusSource::Measured,
            }),
            height_m: 6.1,
            crown_base_m: Some(4.0),
            crown_area_m2: 3.0,
            crown_diameter_m: 1.95,
            stem_volume_m3: 0.45,
            thick_volume_m3: 0.014,
            thin_volume_m3: 0.0,
            surface_m2: 6.2,
            length_m: 7.8,
            taper: vec![step(0.5, 0.4), step(1.5, 0.39)],
        },
        cloud_to_model: Distances { count: 9, mean_m: 0.01, rms_m: 0.02, p95_m: 0.03, max_m: 0.05 },
        model_to_cloud: Distances::default(),
        consolidation: ConsolidationEffect {
            consolidated_mean_m: f64::NAN,
            ..ConsolidationEffect::default()
        },
    }
}
