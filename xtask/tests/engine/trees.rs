//! Stages that work on trees: which trees there are is known once an earlier stage has run.

use crate::support::{None, Stand, trip};
use std::collections::BTreeMap;
use timberline_artefact::kinds::{Detections, GroundPoints, Heights, OutputFile, Outputs};
use timberline_artefact::stage::{
    Context, DynStage, InputSpec, Inputs, Stage, StageError, StageInfo, erase,
};
use timberline_artefact::{Facts, Kind, TreeUnit, UnitKind};
use timberline_pointcloud::Bounds3;

/// Names one tree a column of tiles: its points lie in all four of them.
struct Name;
impl Stage for Name {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::own(Heights::NAME)];
        StageInfo {
            name: "name",
            version: 1,
            summary: "names trees",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &[Detections::NAME],
        }
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let rect = context.campaign().grid.ok_or("no grid")?.rect(inputs.tile()?);
        let [x, y] = rect.min;
        let bounds = Bounds3 { min: [x + 1.0, y + 1.0, 0.0], max: [x + 9.0, y + 9.0, 20.0] };
        let tree_id = 100 + inputs.tile()?.ix as u64;
        let trees = vec![TreeUnit { tree_id, points: 10, bounds }];
        context.emit(&Detections::default(), Facts { trees, ..Facts::default() })?;
        Ok(())
    }
}

/// Counts the tiles a tree reaches into.
struct Grow;
impl Stage for Grow {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::own(Heights::NAME)];
        StageInfo {
            name: "grow",
            version: 1,
            summary: "tiles of a tree",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[GroundPoints::NAME],
        }
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        trip(inputs)?;
        let supplied = inputs.tiles_of(Heights::NAME).len() as u64;
        context.emit(&GroundPoints { ground: Vec::new(), supplied }, Facts::default())?;
        Ok(())
    }
}

/// Lists the trees with their tiles.
struct List;
impl Stage for List {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::all(GroundPoints::NAME)];
        StageInfo {
            name: "list",
            version: 1,
            summary: "all trees",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Outputs::NAME],
        }
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut lines = String::new();
        for tree in inputs.each::<GroundPoints>() {
            let (unit, _, GroundPoints { supplied, .. }) = tree?;
            lines += &format!("{unit} {supplied}\n");
        }
        let path = context.outputs_folder().join("trees.txt");
        timberline_artefact::publish::write_atomic(&path, lines.as_bytes())?;
        let files = vec![OutputFile::describe(context.outputs_folder(), "trees.txt")?];
        context.emit(&Outputs { files, totals: BTreeMap::new() }, Facts::default())?;
        Ok(())
    }
}

pub(crate) fn stages() -> Vec<Box<dyn DynStage>> {
    vec![erase::<Name>(), erase::<Grow>(), erase::<List>()]
}

fn stand() -> Stand {
    let stand = Stand::new();
    let stages = r#"["scan", "sum", "name", "grow", "list"]"#;
    stand.write("pipeline.toml", &format!("name = \"tiny\"\nstages = {stages}\n"));
    stand
}

fn list(stand: &Stand) -> String {
    std::fs::read_to_string(stand.path(".timberline/outputs/trees.txt")).unwrap()
}

#[test]
fn a_tree_is_one_unit_however_many_tiles_it_reaches_into() {
    let stand = stand();
    let ran = stand.run(&[]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(Stand::done(&ran)["grow"], 4);
    assert_eq!(list(&stand), "tree:100 4\ntree:101 4\ntree:102 4\ntree:103 4\n");
    assert_eq!(Stand::done(&stand.run(&[])), BTreeMap::new());
}

#[test]
fn a_tree_that_fails_costs_no_other() {
    let stand = stand();
    let ran = stand.run(&[("XTASK_TEST_FAIL", "tree:102")]);
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert_eq!(list(&stand), "tree:100 4\ntree:101 4\ntree:103 4\n");
    assert!(ran.stderr.contains("grow/tree:102 failed: tripped on purpose"), "{}", ran.stderr);
    // The next run makes that tree and the list, nothing else.
    let again = stand.run(&[]);
    assert_eq!(again.code, 0, "{}", again.stderr);
    let expected = [("grow", 1), ("list", 1)].map(|(stage, count)| (stage.to_owned(), count));
    assert_eq!(Stand::done(&again), BTreeMap::from(expected));
    assert_eq!(list(&stand).lines().count(), 4);
}

#[test]
fn a_plan_says_that_trees_are_not_known_yet() {
    let stand = stand();
    let pipeline = stand.path("pipeline.toml");
    let plan = || stand.xtask(&["plan", pipeline.to_str().unwrap()], &[]).stdout;
    assert!(plan().contains("its trees are known once `name` has run"), "{}", plan());
    stand.run(&[]);
    assert!(!plan().contains('?'), "{}", plan());
}

#[test]
fn one_tree_can_be_run_alone() {
    let stand = stand();
    stand.run(&[]);
    let pipeline = stand.path("pipeline.toml");
    let args = ["run", pipeline.to_str().unwrap(), "--only", "grow/tree:101", "--json"];
    let ran = stand.xtask(&args, &[]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(Stand::done(&ran), BTreeMap::from([("grow".to_owned(), 1)]));
}
