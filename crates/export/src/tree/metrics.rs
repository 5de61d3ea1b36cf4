//! `metrics.json`: all that is known about a tree, for programs.

use super::Model;
use super::scene::Watertight;
use serde::Serialize;
use timberline_artefact::kinds::{ConsolidationEffect, Distances, TreeMetrics};

#[derive(Serialize)]
struct Document<'a> {
    tree_id: u64,
    crs: &'a str,
    /// Base of the stem in the world, m.
    base_m: [f64; 3],
    base_source: &'static str,
    /// What to add to positions in meshes to get to the world, m.
    offset_m: [i64; 3],
    branches: usize,
    cylinders: usize,
    metrics: &'a TreeMetrics,
    cloud_to_model: &'a Distances,
    model_to_cloud: &'a Distances,
    consolidation: &'a ConsolidationEffect,
    watertight: Option<Told>,
}

/// What the closed mesh is: on a grid, so that the thinnest branches are not in it.
#[derive(Serialize)]
struct Told {
    volume_m3: f64,
    triangles: usize,
    grid_edge_m: f64,
    least_radius_m: f64,
    thickened_pieces: u64,
    left_out_pieces: u64,
}

/// The document; a value that is not known is `null`.
///
/// # Errors
/// What serde_json says; nothing here can make it.
pub fn write(model: &Model<'_>, closed: Option<&Watertight>) -> Result<Vec<u8>, serde_json::Error> {
    let qsm = model.qsm;
    let watertight = closed.map(|Watertight { closed, left_out }| Told {
        volume_m3: closed.mesh.volume_m3(),
        triangles: closed.mesh.triangles.len(),
        grid_edge_m: closed.cell_m,
        least_radius_m: closed.least_radius_m,
        thickened_pieces: closed.thickened,
        left_out_pieces: *left_out,
    });
    let mut bytes = serde_json::to_vec_pretty(&Document {
        tree_id: qsm.tree_id,
        crs: &model.crs.name,
        base_m: qsm.base_m,
        base_source: qsm.base_source.name(),
        offset_m: model.frame.origin_m,
        branches: qsm.branches.len(),
        cylinders: qsm.cylinders.len(),
        metrics: &qsm.metrics,
        cloud_to_model: &qsm.cloud_to_model,
        model_to_cloud: &qsm.model_to_cloud,
        consolidation: &qsm.consolidation,
        watertight,
    })?;
    bytes.push(b'\n');
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{FRAME, fork};
    use timberline_artefact::Crs;

    #[test]
    fn what_is_not_known_is_null() {
        let (qsm, crs) = (fork(7), Crs::default());
        let bytes = write(&Model { qsm: &qsm, frame: FRAME, crs: &crs }, None).unwrap();
        let value: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
        assert_eq!(value["offset_m"][1], 5_000_000);
        assert_eq!(value["metrics"]["dbh"]["diameter_m"], 0.4);
        assert!(value["consolidation"]["consolidated_mean_m"].is_null());
        assert!(value["watertight"].is_null());
    }
}
