//! The stage `plot-map`: the plan of the stems of a campaign.

use crate::plot::{PlotTree, draw};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use timberline_artefact::kinds::{Outputs, Qsm, Stems};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, OutputFolder, UnitKind};

/// Parameters of the stage `plot-map`: there are none.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {}

impl timberline_artefact::stage::Params for Params {}

/// The plan of a plot as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct PlotMapStage;

const NAME: &str = "plot-map";
const FILE: &str = "plot.png";

const INPUTS: &[InputSpec] = &[InputSpec::all(Stems::NAME), InputSpec::all(Qsm::NAME)];

impl Stage for PlotMapStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: NAME,
            version: 1,
            summary: "plan of the plot: stems from above by diameter, reach of their branches",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Outputs::NAME],
        }
    }

    /// The picture; the models are read one after the other.
    fn memory_bytes(_params: &Params, _points: u64) -> u64 {
        500 << 20
    }

    fn run(_params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut folder = OutputFolder::open(context.outputs_folder(), NAME)?;
        let mut located = Facts::default();
        let mut trees = BTreeMap::new();
        for stems in inputs.each::<Stems>() {
            let (_, header, Stems { stems, .. }) = stems?;
            located.crs = located.crs.take().or(header.facts.crs);
            for stem in stems {
                let tree = PlotTree {
                    tree_id: stem.tree_id,
                    base_m: [stem.base_m[0], stem.base_m[1]],
                    dbh_m: Some(stem.dbh_m).filter(|dbh| dbh.is_finite()),
                    reach_m: Vec::new(),
                    has_model: false,
                };
                trees.insert(stem.tree_id, tree);
            }
        }
        for model in inputs.each::<Qsm>() {
            context.check_cancelled()?;
            let (_, header, qsm) = model?;
            let frame = header.facts.frame.ok_or("a tree model without a frame")?;
            let ends = qsm.cylinders.iter().map(|c| frame.world_from_local(c.end_m));
            let tree = PlotTree {
                tree_id: qsm.tree_id,
                base_m: [qsm.base_m[0], qsm.base_m[1]],
                dbh_m: qsm.metrics.dbh.map(|dbh| dbh.diameter_m),
                reach_m: ends.map(|[x, y, _]| [x, y]).collect(),
                has_model: true,
            };
            trees.insert(qsm.tree_id, tree);
        }
        let trees: Vec<PlotTree> = trees.into_values().collect();
        // A campaign without trees has no plan, which is no failure.
        if !trees.is_empty() {
            let crs = located.crs.clone().unwrap_or_default();
            let name = &context.campaign().name;
            let title = if name.is_empty() { "Stems" } else { name };
            draw(title, &crs, &trees)?.write_png(&folder.file(FILE))?;
        }
        let files = folder.publish(|name| name == FILE)?;
        let totals = BTreeMap::from([("trees".to_owned(), trees.len() as u64)]);
        context.emit(&Outputs { files, totals }, located)?;
        Ok(())
    }
}
