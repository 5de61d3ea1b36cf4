//! The stage with a program of the user's in place of a method.

use crate::hook::{Limits, Program, Request, resolve, segment};
use crate::{Claim, Marker};
use timberline_artefact::stage::{Context, Inputs, StageError};
use timberline_artefact::{Aligned, Crs, Error, Surroundings, gather};
use timberline_pointcloud::{Frame, Rect};

/// What a stage's parameters say about a program.
pub(super) struct Hooked<'a> {
    /// Its words.
    pub(super) command: &'a [String],
    /// Surroundings of a tile that it is given, m.
    pub(super) halo_m: f64,
    /// Farthest that a point may be from its tree, m.
    pub(super) reach_m: f64,
    /// Time limit, s.
    pub(super) time_limit_s: u32,
    /// Memory limit, MB.
    pub(super) memory_limit_mb: u32,
}

/// The tree of every point of a tile and its surroundings, by a program. `markers` gives the trees
/// near a rectangle of the world, in a frame.
///
/// Where no tree is near, it is not asked.
pub(super) fn claims_by_program(
    params: &Hooked<'_>,
    inputs: &Inputs,
    context: &Context<'_>,
    markers: impl Fn(&Rect, &Frame) -> Result<Vec<Marker>, Error>,
) -> Result<(Surroundings, Vec<Claim>), StageError> {
    let halo_m = params.halo_m;
    let all = gather(inputs, halo_m, &[Aligned::Height, Aligned::Ground])?;
    let markers = markers(&all.tile_rect.grown(halo_m), &all.cloud.frame)?;
    if markers.is_empty() {
        let none = vec![Claim::default(); all.cloud.len()];
        return Ok((all, none));
    }
    let crs = all.located.crs.clone().unwrap_or_default();
    let own: Vec<bool> = all.own.iter().map(Option::is_some).collect();
    let request = Request {
        cloud: &all.cloud,
        height_m: &all.height_m,
        is_ground: &all.is_ground,
        own: &own,
        markers: &markers,
        reach_m: params.reach_m,
        crs: &crs,
    };
    let folder = context.scratch()?;
    let command = resolve(params.command, |name| context.file(name));
    let program = Program {
        command: &command,
        title: &params.command.join(" "),
        environment: &environment(context, &crs, halo_m),
        limits: Limits::new(params.time_limit_s, params.memory_limit_mb),
        folder: &std::path::absolute(folder.path())?,
    };
    let cancelled = || context.check_cancelled().is_err();
    let claims = segment(&request, &program, &cancelled, &mut |text| context.log(text))?;
    Ok((all, claims))
}

fn environment(context: &Context<'_>, crs: &Crs, halo_m: f64) -> [(&'static str, String); 4] {
    [
        ("TIMBERLINE_UNIT", context.unit().to_string()),
        ("TIMBERLINE_HALO_M", halo_m.to_string()),
        ("TIMBERLINE_M_PER_UNIT", crs.horizontal_m_per_unit.to_string()),
        ("TIMBERLINE_VERTICAL_M_PER_UNIT", crs.vertical_m_per_unit.to_string()),
    ]
}
