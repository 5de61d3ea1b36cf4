//! A tiny chain of stages over text files of points, and a way to run it as a process of its own.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use timberline_artefact::container::ContainerReader;
use timberline_artefact::kinds::{Heights, Labels, OutputFile, Outputs, Shards};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, NamedFile, Params, Stage, StageError, StageInfo, erase,
};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::{Rect, TileId};
use xtask::cli::Program;
use xtask::engine::survey::{FileFacts, Surveyor};
use xtask::registry::Registry;

const ARGS: &str = "XTASK_TEST_ARGS";
/// A script with this text has another one after it was read.
pub(crate) const REWRITES_ITSELF: &str = "rewrites itself";
static CANCEL: AtomicBool = AtomicBool::new(false);

#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct None {}
impl Params for None {}

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Scale {
    /// What heights are multiplied with.
    #[schemars(range(min = 0.5, max = 9.0), extend("x-unit" = "m"))]
    pub(crate) factor: f64,
    /// What is added to them.
    #[schemars(range(min = -1.0, max = 1.0), extend("x-unit" = "m"))]
    pub(crate) offset_m: f64,
    /// A file that is read; none if empty.
    pub(crate) script: String,
    /// How long a unit may take.
    #[schemars(range(min = 1.0), extend("x-unit" = "s", "x-limit" = true))]
    pub(crate) limit_s: f64,
}
impl Default for Scale {
    fn default() -> Self {
        Self { factor: 1.0, offset_m: 0.0, script: String::new(), limit_s: 9.0 }
    }
}
impl Params for Scale {
    fn check(&self) -> Vec<String> {
        if self.factor == 7.0 && self.offset_m == 1.0 {
            return vec!["`factor` 7 does not go with `offset_m` 1".to_owned()];
        }
        Vec::new()
    }
}

/// Waits as long as the test wants a unit to take.
fn linger() {
    let wait = std::env::var("XTASK_TEST_SLOW_MS").ok().and_then(|text| text.parse().ok());
    std::thread::sleep(Duration::from_millis(wait.unwrap_or(0)));
}

pub(crate) fn trip(inputs: &Inputs) -> Result<(), StageError> {
    let unit = inputs.unit().to_string();
    match std::env::var("XTASK_TEST_FAIL") {
        Ok(fail) if fail == unit => Err("tripped on purpose".into()),
        Ok(fail) if fail == format!("panic {unit}") => panic!("index out of range on purpose"),
        _ => Ok(()),
    }
}

pub(crate) struct Scan;
impl Stage for Scan {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[];
        let (inputs, outputs): (_, &[&str]) = (INPUTS, &[Shards::NAME]);
        StageInfo {
            name: "scan",
            version: 1,
            summary: "reads a file",
            unit: UnitKind::File,
            inputs,
            outputs,
        }
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let points = read_points(&inputs.raw()?.path)?;
        let grid = context.campaign().grid.ok_or("no grid")?;
        context.emit_stream::<Shards>(|out| {
            let mut parts = BTreeSet::new();
            for [x, y, z] in &points {
                let tile = grid.tile_at(*x, *y);
                parts.insert(tile);
                writeln!(out, "{tile} {z}")?;
            }
            linger();
            let facts = Facts { parts: parts.into_iter().collect(), ..Facts::default() };
            Ok(facts.count("points", points.len()))
        })
    }
}

fn read_points(path: &Path) -> Result<Vec<[f64; 3]>, StageError> {
    let mut points = Vec::new();
    for line in BufReader::new(std::fs::File::open(path)?).lines() {
        let line = line?;
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        points.push(<[f64; 3]>::try_from(numbers?).map_err(|_| format!("`{line}` is no point"))?);
    }
    Ok(points)
}

pub(crate) struct Sum<const VERSION: u32>;
impl<const VERSION: u32> Stage for Sum<VERSION> {
    type Params = Scale;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::own(Shards::NAME)];
        let (inputs, outputs): (_, &[&str]) = (INPUTS, &[Heights::NAME]);
        StageInfo {
            name: "sum",
            version: VERSION,
            summary: "heights of a tile",
            unit: UnitKind::Tile,
            inputs,
            outputs,
        }
    }
    fn files(params: &Scale) -> Vec<NamedFile> {
        let named = NamedFile { name: params.script.clone(), param: "script", required: true };
        Some(named).filter(|named| !named.name.is_empty()).into_iter().collect()
    }
    fn run(params: &Scale, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        if let Some(path) = context.file(&params.script) {
            let text = std::fs::read_to_string(path)?;
            if text == REWRITES_ITSELF {
                std::fs::write(path, "another text")?;
            }
            context.log(format!("the script says {text}"));
        }
        trip(inputs)?;
        let tile = inputs.tile()?.to_string();
        let mut height_m = Vec::new();
        for file in inputs.files_of(Shards::NAME) {
            let mut reader = ContainerReader::open(&file.path)?;
            let text = String::from_utf8(reader.payload()?)?;
            let mine = text.lines().filter_map(|line| line.strip_prefix(&format!("{tile} ")));
            for z in mine {
                height_m.push((z.parse::<f64>()? * params.factor + params.offset_m) as f32);
            }
        }
        height_m.sort_by(f32::total_cmp);
        let facts = Facts::default().count("points", height_m.len());
        context.emit(&Heights { height_m }, facts)?;
        linger();
        Ok(())
    }
}

pub(crate) struct Blur;
impl Stage for Blur {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::halo(Heights::NAME)];
        let (inputs, outputs): (_, &[&str]) = (INPUTS, &[Labels::NAME]);
        StageInfo {
            name: "blur",
            version: 1,
            summary: "sums of neighbours",
            unit: UnitKind::Tile,
            inputs,
            outputs,
        }
    }
    fn halo_m(_: &None) -> f64 {
        1.0
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut score = Vec::new();
        for row in inputs.each::<Heights>() {
            score.push(row?.2.height_m.iter().sum());
        }
        context.warn("tile", "blurred");
        let tree_id = vec![0; score.len()];
        context.emit(&Labels { tree_id, score }, Facts::default())?;
        linger();
        Ok(())
    }
}

pub(crate) struct Finish;
impl Stage for Finish {
    type Params = None;
    fn info() -> StageInfo {
        const INPUTS: &[InputSpec] = &[InputSpec::all(Labels::NAME)];
        let (inputs, outputs): (_, &[&str]) = (INPUTS, &[Outputs::NAME]);
        StageInfo {
            name: "finish",
            version: 1,
            summary: "a total",
            unit: UnitKind::Campaign,
            inputs,
            outputs,
        }
    }
    fn run(_: &None, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut total = 0.0;
        for row in inputs.each::<Labels>() {
            total += row?.2.score.iter().map(|value| f64::from(*value)).sum::<f64>();
        }
        let path = context.outputs_folder().join("total.txt");
        timberline_artefact::publish::write_atomic(&path, format!("{total}\n").as_bytes())?;
        let files = vec![OutputFile::describe(context.outputs_folder(), "total.txt")?];
        context.emit(&Outputs { files, totals: BTreeMap::new() }, Facts::default())?;
        linger();
        Ok(())
    }
}

struct TextSurveyor;
impl Surveyor for TextSurveyor {
    fn look(&self, path: &Path) -> Result<FileFacts, String> {
        let points = read_points(path).map_err(|error| error.to_string())?;
        let mut rect = Rect::EMPTY;
        for [x, y, _] in &points {
            rect = rect.union(&Rect { min: [*x, *y], max: [*x, *y] });
        }
        let rect_m = (!points.is_empty()).then_some(rect);
        let points = points.len() as u64;
        Ok(FileFacts { points, rect_m, density_per_m2: None, crs: None, notes: Vec::new() })
    }
    fn tile_edge_m(&self, _: &[FileFacts], _: u32) -> u32 {
        10
    }
}

/// Runs the command line of the child process, if this is one.
pub(crate) fn child() {
    let Ok(args) = std::env::var(ARGS) else { return };
    let args: Vec<String> = serde_json::from_str(&args).unwrap();
    let sum = match std::env::var("XTASK_TEST_VERSION").as_deref() {
        Ok("2") => erase::<Sum<2>>(),
        _ => erase::<Sum<1>>(),
    };
    let mut stages = vec![erase::<Scan>(), sum, erase::<Blur>(), erase::<Finish>()];
    stages.extend(crate::trees::stages());
    let registry = Registry::new(stages);
    let program = Program { registry, surveyor: Box::new(TextSurveyor), cancel: &CANCEL };
    xtask::engine::panics::quieten();
    let code =
        program.main(std::iter::once("xtask".into()).chain(args.into_iter().map(Into::into)));
    std::process::exit(i32::from(code));
}

pub(crate) const PIPELINE: &str = "name = \"tiny\"\nstages = [\"scan\", \"sum\", \"blur\", \"finish\"]\n\n[sum]\nfactor = 2.0\noffset_m = 0.5\n";

/// A campaign of 4 files with 4 tiles each in a folder of its own.
pub(crate) struct Stand {
    pub(crate) folder: tempfile::TempDir,
}

pub(crate) struct Ran {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Stand {
    pub(crate) fn new() -> Self {
        let stand = Self { folder: tempfile::tempdir().unwrap() };
        let campaign = "name = \"stand\"\nplatform = \"als\"\ninputs = [\"*.txt\"]\n";
        stand.write("campaign.toml", campaign);
        stand.write("pipeline.toml", PIPELINE);
        for row in 0..4 {
            stand.write(&format!("row{row}.txt"), &row_text(row));
        }
        stand
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    /// The command line with this stand's campaign, as a child process.
    pub(crate) fn command(&self, args: &[&str], env: &[(&str, &str)]) -> Command {
        let folder = self.folder.path().to_str().unwrap();
        let mut all: Vec<&str> = args.to_vec();
        all.extend(["--campaign", folder]);
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", "child_process", "--ignored", "--test-threads=2"]);
        command.env(ARGS, serde_json::to_string(&all).unwrap()).envs(env.iter().copied());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    pub(crate) fn xtask(&self, args: &[&str], env: &[(&str, &str)]) -> Ran {
        ended(self.command(args, env).spawn().unwrap())
    }

    pub(crate) fn run(&self, env: &[(&str, &str)]) -> Ran {
        let pipeline = self.path("pipeline.toml");
        self.xtask(&["run", pipeline.to_str().unwrap(), "--json", "--jobs", "2"], env)
    }

    /// Units that ran, by stage, according to the report of a run.
    pub(crate) fn done(ran: &Ran) -> BTreeMap<String, u64> {
        let report: serde_json::Value = serde_json::from_str(&ran.stdout).expect(&ran.stderr);
        let stages = report["stages"].as_array().unwrap();
        let row = |stage: &serde_json::Value| {
            (
                stage["stage"].as_str().unwrap().to_owned(),
                stage["units"]["done"].as_u64().unwrap_or(0),
            )
        };
        stages.iter().map(row).filter(|(_, done)| *done > 0).collect()
    }

    /// Contents of all files of the store and the outputs, by path.
    pub(crate) fn products(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let work = self.path(".timberline");
        for part in ["store", "outputs"] {
            xtask::engine::workdir::walk(&work.join(part), &mut |path| {
                files.insert(
                    path.strip_prefix(&work).unwrap().to_owned(),
                    std::fs::read(path).unwrap(),
                );
            });
        }
        files
    }

    /// The only artefact of a unit.
    pub(crate) fn artefact(&self, stage: &str, stem: &str) -> PathBuf {
        let folder = self.path(".timberline/store").join(stage);
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut own: Vec<PathBuf> = files
            .filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with(stem))
            .collect();
        assert_eq!(own.len(), 1, "{own:?}");
        own.remove(0)
    }
}

pub(crate) fn ended(child: Child) -> Ran {
    let output = child.wait_with_output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    let stdout = text(output.stdout).replacen("\nrunning 1 test\n", "", 1);
    Ran { code: output.status.code().unwrap_or(-1), stdout, stderr: text(output.stderr) }
}

/// Points of one row of tiles: four tiles of 10 m, ten points each.
pub(crate) fn row_text(row: u32) -> String {
    let point = |index: u32| {
        format!("{} {} {}\n", f64::from(index) + 0.5, f64::from(row) * 10.0 + 5.0, index % 7)
    };
    (0..40).map(point).collect()
}

pub(crate) fn tile(ix: i32, iy: i32) -> String {
    TileId { ix, iy }.to_string()
}
