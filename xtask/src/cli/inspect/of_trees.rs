//! The tables inside artefacts about single trees.

use anyhow::Result;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;
use timberline_artefact::kinds::{Consolidated, Distances, Qsm, TreeCloud, TreeFile};
use timberline_artefact::read;
use timberline_pointcloud::PointCloud;

/// The points of a tree, and what is known about its stem.
pub(super) fn tree_cloud(path: &Path) -> Result<Value> {
    let (_, TreeCloud { stem, cloud }) = read::<TreeCloud>(path)?;
    points(&cloud, "stem", &stem)
}

/// The consolidated points of a tree, and what consolidation did.
pub(super) fn consolidated(path: &Path) -> Result<Value> {
    let (_, Consolidated { consolidation, cloud }) = read::<Consolidated>(path)?;
    points(&cloud, "consolidation", &consolidation)
}

fn points(cloud: &PointCloud, name: &str, about: &impl Serialize) -> Result<Value> {
    let mut value = serde_json::to_value(cloud)?;
    value[name] = row(about)?;
    Ok(value)
}

/// A table of one row.
fn row(value: &impl Serialize) -> Result<Value> {
    Ok(json!([serde_json::to_value(value)?]))
}

/// The model of a tree: its metrics, its distances, its cylinders and branches.
pub(super) fn qsm(path: &Path) -> Result<Value> {
    let (_, qsm) = read::<Qsm>(path)?;
    let mut metrics = serde_json::to_value(&qsm.metrics)?;
    let taper = metrics.as_object_mut().and_then(|metrics| metrics.remove("taper"));
    let dbh = metrics.as_object_mut().and_then(|metrics| metrics.remove("dbh"));
    metrics["base_m"] = json!(qsm.base_m);
    metrics["base_source"] = json!(qsm.base_source);
    let distances = |from: &str, distances: &Distances| -> Result<Value> {
        let mut value = serde_json::to_value(distances)?;
        value["from"] = json!(from);
        Ok(value)
    };
    Ok(json!({
        "metrics": [metrics],
        "dbh": dbh.filter(Value::is_object).map_or(json!([]), |dbh| json!([dbh])),
        "taper": taper,
        "distances": [
            distances("points", &qsm.cloud_to_model)?,
            distances("model", &qsm.model_to_cloud)?,
        ],
        "consolidation": row(&qsm.consolidation)?,
        "branches": qsm.branches,
        "cylinders": qsm.cylinders,
    }))
}

/// Names and sizes of files.
pub(super) fn files(files: &[TreeFile]) -> Value {
    let file = |file: &TreeFile| json!({ "name": file.name, "bytes": file.bytes.len() });
    json!({ "files": files.iter().map(file).collect::<Vec<_>>() })
}
