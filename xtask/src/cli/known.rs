//! Known trees and what a run knows of them: for `evaluate` and `experiment`.

use super::Usage;
use super::open::Opened;
use crate::engine::explain::DryRun;
use crate::engine::plan::UnitPlan;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use timberline_artefact::header::UnitId;
use timberline_artefact::kinds::{Labels, PointTile, Tree as FoundTree, Trees};
use timberline_artefact::{Kind, read};
use timberline_evaluate::Tree;
use timberline_experiment::crowns::Cluster;

/// Which position of a tree is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Position {
    /// Highest point
    Apex,
    /// Stem
    Stem,
}

/// Columns of tables of trees that hold a position, the first that is there.
pub type Columns = [&'static [&'static str]; 2];

/// Columns of stems that say so.
pub const STEMS: Columns = [&["base_x_m", "stem_x"], &["base_y_m", "stem_y"]];

impl Position {
    /// The columns that hold it; a table with one position only may call it x and y.
    #[must_use]
    pub fn columns(self) -> Columns {
        match self {
            Self::Apex => [&["top_x_m", "x_m", "x"], &["top_y_m", "y_m", "y"]],
            Self::Stem => {
                [&["base_x_m", "stem_x", "x_m", "x"], &["base_y_m", "stem_y", "y_m", "y"]]
            }
        }
    }
}

/// Which trees of a table count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Lower ones do not, m.
    pub min_height_m: f64,
    /// Those that the scanner cannot see do.
    pub hidden: bool,
}

/// Reads a table of trees (CSV with a heading, metres).
///
/// # Errors
/// When the file cannot be read or lacks a column.
pub fn read_trees(path: &Path, columns: Columns, filter: Filter) -> Result<Vec<Tree>> {
    let place = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(place)?;
    let heading = reader.headers().with_context(place)?.clone();
    let column =
        |names: &[&str]| names.iter().find_map(|name| heading.iter().position(|own| own == *name));
    let needed = |names: &[&str]| {
        column(names).ok_or_else(|| Usage(format!("{}: no column {}", place(), names.join(" or "))))
    };
    let (x, y) = (needed(columns[0])?, needed(columns[1])?);
    let height = needed(&["top_above_ground_m", "height_m", "height"])?;
    let (id, visible) = (column(&["tree_id", "id"]), column(&["visible"]));
    let (diameter, radius) = (column(&["crown_diameter_m"]), column(&["crown_radius_m"]));
    let mut trees = Vec::new();
    for (index, row) in reader.records().enumerate() {
        let row = row.with_context(place)?;
        let number = |at: usize| {
            row.get(at).and_then(|text| text.trim().parse::<f64>().ok()).unwrap_or(f64::NAN)
        };
        let seen = filter.hidden || visible.is_none_or(|at| number(at) != 0.0);
        let crown = diameter.map(&number).or_else(|| radius.map(|at| 2.0 * number(at)));
        let own_id = id.and_then(|at| row.get(at)?.parse().ok());
        let tree = Tree {
            id: own_id.unwrap_or(index as u64 + 1),
            at_m: [number(x), number(y)],
            height_m: number(height),
            crown_diameter_m: crown.unwrap_or(f64::NAN),
            layer: None,
        };
        let high = tree.height_m.is_nan() || tree.height_m >= filter.min_height_m;
        if seen && high && tree.at_m.iter().all(|value| value.is_finite()) {
            trees.push(tree);
        }
    }
    Ok(trees)
}

/// The artefacts of a kind that are in the store, by unit.
///
/// # Errors
/// When no stage of the pipeline writes the kind, or the store has none of it.
pub fn artefacts(
    opened: &Opened,
    dry: &DryRun<'_>,
    kind: &str,
) -> Result<BTreeMap<UnitId, PathBuf>> {
    let writes = |stage: &crate::config::PipelineStage| stage.stage.info().outputs.contains(&kind);
    let stages = &opened.pipeline.stages;
    let position =
        stages.iter().rposition(writes).with_context(|| format!("no stage writes `{kind}`"))?;
    let whole = dry.stages[position].iter().filter(|plan| plan.is_whole());
    let path = |plan: &UnitPlan| {
        opened.store.path(stages[position].name(), plan.unit(), &plan.task.key, kind)
    };
    let paths: BTreeMap<UnitId, PathBuf> =
        whole.map(|plan| (plan.unit().clone(), path(plan))).collect();
    if paths.is_empty() {
        return Err(Usage(format!("the store has no `{kind}`: run the pipeline first")).into());
    }
    Ok(paths)
}

/// The trees of a run from a height on.
///
/// # Errors
/// As [`artefacts`], and when one of them cannot be read.
pub fn trees_of_run(
    opened: &Opened,
    dry: &DryRun<'_>,
    min_height_m: f64,
) -> Result<Vec<FoundTree>> {
    let mut trees = Vec::new();
    for path in artefacts(opened, dry, Trees::NAME)?.values() {
        trees.extend(read::<Trees>(path)?.1.trees);
    }
    trees.retain(|tree| tree.height_m >= min_height_m);
    Ok(trees)
}

/// A tree of a run as `evaluate` compares it.
#[must_use]
pub fn as_tree(tree: &FoundTree, position: Position) -> Tree {
    let at_m = match position {
        Position::Apex => [tree.apex_m[0], tree.apex_m[1]],
        Position::Stem => tree.position_m,
    };
    let crown_diameter_m =
        if tree.crown_area_m2 > 0.0 { tree.crown_diameter_mean_m } else { f64::NAN };
    Tree { id: tree.id, at_m, height_m: tree.height_m, crown_diameter_m, layer: None }
}

/// The crowns of a run whose stems are known: for every tree id, in world coordinates, the points on
/// its crown's surface. Trees without such points are left out.
///
/// # Errors
/// As [`artefacts`], and when one of them cannot be read or does not fit the others.
pub fn clusters(
    opened: &Opened,
    dry: &DryRun<'_>,
    stems: &BTreeMap<u64, Tree>,
) -> Result<Vec<Cluster>> {
    let tiles = artefacts(opened, dry, PointTile::NAME)?;
    let mut points: BTreeMap<u64, Vec<[f64; 3]>> = BTreeMap::new();
    for (unit, path) in artefacts(opened, dry, Labels::NAME)? {
        let (_, labels) = read::<Labels>(&path)?;
        let tile =
            tiles.get(&unit).with_context(|| format!("the store has no points of {unit}"))?;
        let (_, PointTile { cloud }) = read::<PointTile>(tile)?;
        ensure!(
            cloud.len() == labels.tree_id.len() && cloud.len() == labels.score.len(),
            "{}: {} labels for {} points",
            path.display(),
            labels.tree_id.len(),
            cloud.len()
        );
        let labelled = labels.tree_id.iter().zip(&labels.score).enumerate();
        for (index, (id, _)) in labelled.filter(|(_, (_, score))| **score > Labels::ON_SURFACE) {
            if stems.contains_key(id) {
                points.entry(*id).or_default().push(cloud.world(index));
            }
        }
    }
    let cluster = |(id, points): (u64, Vec<[f64; 3]>)| {
        let stem = stems.get(&id)?;
        let (reference, height_m) = (stem.at_m, stem.height_m);
        Some(Cluster { id, repeat: 1, points, reference, height_m, faults: Vec::new() })
    };
    Ok(points.into_iter().filter_map(cluster).collect())
}

/// Stems by the id of the found tree, of those matched.
#[must_use]
pub fn stems_of_found(
    matching: &timberline_evaluate::Matching,
    reference: &[Tree],
    found: &[Tree],
    stems: &[Tree],
) -> BTreeMap<u64, Tree> {
    let by_id: BTreeMap<u64, &Tree> = stems.iter().map(|tree| (tree.id, tree)).collect();
    let stem = |pair: &timberline_evaluate::Pair| {
        let stem = by_id.get(&reference[pair.reference].id)?;
        Some((found[pair.detected].id, **stem))
    };
    matching.pairs.iter().filter_map(stem).collect()
}
