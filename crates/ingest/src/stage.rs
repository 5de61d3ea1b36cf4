//! The stages `scatter` and `tiles`.

use crate::gather::{self, Gathered, gather};
use crate::scatter::{Scattered, scatter};
use crate::shard::ShardReader;
use crate::{Error, ScatterParams, TilesParams, scan};
use timberline_artefact::container::ContainerReader;
use timberline_artefact::kinds::{PointTile, Shards};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::TileGrid;

/// Reads a raw file and buckets its points by tile.
#[derive(Debug, Clone, Copy)]
pub struct Scatter;

impl Stage for Scatter {
    type Params = ScatterParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "scatter",
            version: 1,
            summary: "reads a point cloud of any known format and buckets its points by tile",
            unit: UnitKind::File,
            inputs: &[],
            outputs: &[Shards::NAME],
        }
    }

    /// Batches and buffers, whatever the size of the file.
    fn memory_bytes(_: &ScatterParams, points: u64) -> u64 {
        const BATCHES_AND_BUFFERS: u64 = 320 << 20;
        const BYTES_PER_POINT: u64 = 400;
        (points * BYTES_PER_POINT).min(BATCHES_AND_BUFFERS)
    }

    fn run(
        params: &ScatterParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let raw = inputs.raw()?;
        let grid = grid_of(context)?;
        let crs = context.campaign().crs.as_ref();
        let file = scan::open(&raw.path, params.units(), crs)?;
        context.emit_stream::<Shards>(|out| {
            let mut stopped = Ok(());
            let progress = |points: u64| {
                context.advance(points);
                stopped = context.check_cancelled();
                // The message is replaced by that of `stopped` below.
                stopped.map_err(|cancelled| Error::Params(cancelled.to_string()))
            };
            let result = scatter(file, grid, params, out, progress);
            stopped?;
            let (_, scattered) = result.map_err(|error| error.in_file(&raw.path))?;
            let subject = format!("file {}", raw.name);
            scattered.notes.iter().for_each(|note| context.warn(&subject, note));
            Ok(scatter_facts(&scattered))
        })
    }
}

fn grid_of(context: &Context<'_>) -> Result<TileGrid, Error> {
    let missing = || Error::Params("the campaign has no tile grid; set a tile edge".to_owned());
    context.campaign().grid.ok_or_else(missing)
}

fn scatter_facts(scattered: &Scattered) -> Facts {
    let index = &scattered.index;
    let counts = [
        ("points", index.points),
        ("points_outside", scattered.outside),
        ("points_lost_to_damage", scattered.lost),
        ("points_without_return_number", scattered.zero_returns),
        ("points_ground_class", scattered.ground),
        ("files_normalised", u64::from(scattered.is_normalised)),
    ];
    Facts {
        crs: Some(index.crs.clone()),
        bounds: index.bounds,
        grid: Some(index.grid),
        counts: counts.into_iter().map(|(name, count)| (name.to_owned(), count)).collect(),
        parts: index.tiles(),
        ..Facts::default()
    }
}

/// The shards of files with points in the tile or near enough to keep its points company.
const INPUTS: [InputSpec; 1] = [InputSpec::halo(Shards::NAME)];

/// Puts a tile together from the shards of all files.
#[derive(Debug, Clone, Copy)]
pub struct Tiles;

impl Stage for Tiles {
    type Params = TilesParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "tiles",
            version: 2,
            summary: "puts a tile together: drops noise, withheld, isolated and duplicate points, thins, marks outliers",
            unit: UnitKind::Tile,
            inputs: &INPUTS,
            outputs: &[PointTile::NAME],
        }
    }

    /// Points of neighbouring tiles decide whether a point at the border is isolated or an outlier.
    fn halo_m(params: &TilesParams) -> f64 {
        gather::halo_m(params)
    }

    fn run(params: &TilesParams, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let tile = inputs.tile()?;
        let grid = grid_of(context)?;
        let mut shards = Vec::new();
        for file in inputs.files_of(Shards::NAME) {
            let container = ContainerReader::open(&file.path)?;
            timberline_artefact::open::check_kind::<Shards>(&file.path, container.header())?;
            shards.push(ShardReader::new(container).map_err(|error| error.in_file(&file.path))?);
        }
        context.check_cancelled()?;
        let gathered = gather(tile, grid, &mut shards, params)?;
        context.advance(gathered.given);
        let subject = format!("tile {tile}");
        gathered.notes.iter().for_each(|note| context.warn(&subject, note));
        let facts = tile_facts(&gathered, grid);
        context.emit(&PointTile { cloud: gathered.cloud }, facts)?;
        Ok(())
    }
}

fn tile_facts(gathered: &Gathered, grid: TileGrid) -> Facts {
    let dropped = &gathered.dropped;
    let counts = [
        ("points", gathered.cloud.len() as u64),
        ("dropped_withheld", dropped.withheld),
        ("dropped_noise", dropped.noise),
        ("dropped_overlap", dropped.overlap),
        ("dropped_isolated", dropped.isolated),
        ("dropped_duplicate", dropped.duplicate),
    ];
    // Only where they were asked for.
    let asked = [("dropped_thinned", dropped.thinned), ("marked_outlier", gathered.marked)];
    let counts = counts.into_iter().chain(asked.into_iter().filter(|(_, count)| *count > 0));
    let local = gathered.cloud.bounds();
    let world = |corner: [f64; 3]| gathered.cloud.frame.world_from_local(corner);
    Facts {
        crs: Some(gathered.crs.clone()),
        frame: Some(gathered.cloud.frame),
        bounds: (!local.is_empty()).then(|| timberline_pointcloud::Bounds3 {
            min: world(local.min),
            max: world(local.max),
        }),
        grid: Some(grid),
        counts: counts.map(|(name, count)| (name.to_owned(), count)).collect(),
        ..Facts::default()
    }
}
