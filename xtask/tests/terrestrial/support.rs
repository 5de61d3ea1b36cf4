//! Campaigns of terrestrial scans in folders of their own, and what a run of the shipped pipeline left.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use timberline_artefact::Crs;
use timberline_pointcloud::PointCloud;
use xtask::cli::sample::write_scan;
use xtask::engine::workdir::{leftovers, walk};

/// A line of a table by column.
pub(crate) type Row = BTreeMap<String, String>;

/// A campaign over the scans of its folder, and the pipeline that it is run with.
pub(crate) struct Campaign {
    folder: tempfile::TempDir,
}

impl Campaign {
    /// A campaign over files of its folder, which are still to be written, or over files elsewhere.
    pub(crate) fn of(inputs: &[&str]) -> Self {
        let campaign = Self { folder: tempfile::tempdir().unwrap() };
        let text = format!("name = \"x\"\nplatform = \"tls\"\ninputs = {inputs:?}\n");
        campaign.write("campaign.toml", text);
        campaign.write("pipeline.toml", shipped());
        campaign
    }

    /// A campaign over one scan without a CRS.
    pub(crate) fn of_cloud(cloud: &PointCloud) -> Self {
        let campaign = Self::of(&["scan.laz"]);
        write_scan(&campaign.path("scan.laz"), cloud, &Crs::default()).unwrap();
        campaign
    }

    /// A campaign over one file.
    pub(crate) fn of_bytes(name: &str, bytes: impl AsRef<[u8]>) -> Self {
        let campaign = Self::of(&[name]);
        campaign.write(name, bytes);
        campaign
    }

    /// Adds lines to the pipeline file: to a stage's table if there is one, otherwise at the end.
    pub(crate) fn with(self, table: &str, lines: &str) -> Self {
        let text = std::fs::read_to_string(self.path("pipeline.toml")).unwrap();
        let heading = format!("[{table}]\n");
        let more = format!("{heading}{lines}\n");
        let changed = match text.contains(&heading) {
            true => text.replace(&heading, &more),
            false => text + "\n" + &more,
        };
        self.write("pipeline.toml", changed);
        self
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), text).unwrap();
    }

    /// The command that runs the pipeline.
    pub(crate) fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command
            .arg("run")
            .arg(self.path("pipeline.toml"))
            .arg("--campaign")
            .arg(self.folder.path());
        command.args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    /// Runs the pipeline to its end, whatever that is.
    pub(crate) fn try_run(&self, more: &[&str]) -> Ran {
        let Output { status, stdout, stderr } = self.command(more).output().unwrap();
        let said = [stdout, stderr].map(|bytes| String::from_utf8(bytes).unwrap()).concat();
        assert_eq!(leftovers(&self.path(".timberline")), Vec::<PathBuf>::new(), "{said}");
        Ran { code: status.code().expect("ended by a signal"), said }
    }

    /// Runs the pipeline, which must come to a good end.
    pub(crate) fn run(&self, more: &[&str]) -> Ran {
        let ran = self.try_run(more);
        assert_eq!(ran.code, 0, "{}", ran.said);
        ran
    }

    /// Contents of all files in some folders of the work folder, by path.
    pub(crate) fn files(&self, folders: &[&str]) -> BTreeMap<PathBuf, Vec<u8>> {
        let (work, mut files) = (self.path(".timberline"), BTreeMap::new());
        for folder in folders {
            walk(&work.join(folder), &mut |path| {
                let name = path.strip_prefix(&work).unwrap().to_owned();
                files.insert(name, std::fs::read(path).unwrap());
            });
        }
        files
    }

    /// A table of the outputs.
    pub(crate) fn table(&self, name: &str) -> Vec<Row> {
        rows(&self.path(".timberline/outputs").join(name))
    }
}

/// How a run ended.
pub(crate) struct Ran {
    pub(crate) code: i32,
    /// What it printed, on both streams.
    pub(crate) said: String,
}

/// The shipped pipeline.
fn shipped() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    std::fs::read_to_string(root.join("pipelines/tls-trees.toml")).unwrap()
}

fn rows(path: &Path) -> Vec<Row> {
    let mut table = csv::Reader::from_path(path).unwrap();
    table.deserialize().map(|row| row.unwrap()).collect()
}

/// A number of a table; NaN where there is none.
pub(crate) fn number(row: &Row, column: &str) -> f64 {
    match row[column].as_str() {
        "" => f64::NAN,
        text => text.parse().unwrap_or_else(|_| panic!("{column}: {text}")),
    }
}
