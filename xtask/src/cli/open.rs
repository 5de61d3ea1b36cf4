//! What most commands begin with: the campaign, its pipeline, its files, its workspace.

use super::{Program, Usage};
use crate::config::{Campaign, Pipeline, Problem, Problems};
use crate::engine::notes::Notes;
use crate::engine::runlog::{self, Event};
use crate::engine::workdir::Presence;
use crate::engine::{Store, Survey, WorkDir, survey};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// Which campaign, and where its workspace is.
#[derive(Debug, Clone, clap::Args)]
pub struct Place {
    /// Folder of the campaign (with campaign.toml)
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub campaign: PathBuf,
    /// Workspace of runs [default: .timberline in the campaign's folder]
    #[arg(long, value_name = "DIR")]
    pub work: Option<PathBuf>,
}

impl Place {
    /// The workspace.
    #[must_use]
    pub fn work_dir(&self) -> WorkDir {
        let folder = if self.campaign.is_file() {
            self.campaign.parent().unwrap_or(Path::new("."))
        } else {
            &self.campaign
        };
        WorkDir::of(folder, self.work.as_deref())
    }

    /// How to name this place on a command line.
    #[must_use]
    pub fn flags(&self) -> String {
        let work = self.work.as_ref().map(|work| format!(" --work {}", work.display()));
        format!("--campaign {}{}", self.campaign.display(), work.unwrap_or_default())
    }
}

/// A campaign with everything that commands need.
pub struct Opened {
    /// The campaign.
    pub campaign: Campaign,
    /// The pipeline.
    pub pipeline: Pipeline,
    /// Its raw files.
    pub survey: Survey,
    /// Its workspace.
    pub work: WorkDir,
    /// The store in it.
    pub store: Store,
    _presence: Presence,
}

impl Opened {
    /// Opens a campaign with a pipeline; without one, that of the last run.
    ///
    /// # Errors
    /// Faults of the files, all at once.
    pub fn new(program: &Program, place: &Place, pipeline: Option<&Path>) -> Result<Self> {
        let work = place.work_dir();
        let path = match pipeline {
            Some(path) => path.to_owned(),
            None => last_pipeline(&work)?,
        };
        let (pipeline, campaign) =
            both(Pipeline::load(&path, &program.registry), Campaign::load(&place.campaign))?;
        let presence = work.enter()?;
        // A new name whenever a surveyor tells other things about the same file.
        let notes = Notes::open(work.note("files-2.json"));
        let survey = survey::survey(&campaign, &*program.surveyor, &notes)
            .map_err(|what| Problems::one(Problem::new(&campaign.path, None, what)))?;
        let store = Store::open(&work);
        Ok(Self { campaign, pipeline, survey, work, store, _presence: presence })
    }
}

/// Both results, or the faults of both.
fn both<A, B>(a: Result<A, Problems>, b: Result<B, Problems>) -> Result<(A, B), Problems> {
    match (a, b) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (Err(mut a), Err(b)) => {
            a.0.extend(b.0);
            Err(a)
        }
        (Err(faults), _) | (_, Err(faults)) => Err(faults),
    }
}

fn last_pipeline(work: &WorkDir) -> Result<PathBuf> {
    let missing = || {
        Usage("no pipeline is given and none ran here before; name one, such as pipelines/als-inventory.toml".to_owned())
    };
    let id = runlog::list(&work.runs()).pop().ok_or_else(missing)?;
    let events = runlog::read(&work.runs(), &id)?;
    let start = events.into_iter().find_map(|event| match event {
        Event::Start { pipeline, .. } => Some(pipeline),
        _ => None,
    });
    start.context("the log of the last run has no beginning; name the pipeline")
}
