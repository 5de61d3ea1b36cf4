//! From one pulse to its echoes.

use super::points::Label;
use super::scan_params::ScanParams;
use super::targets::{NO_CYLINDER, Owner, Ray, RayHit, Targets};
use super::vector::{Vec3, across, along, dot, unit};
use crate::pulse::{OUTER, RAYS};
use crate::random::Stream;

/// Shares of light thrown back at 1550 nm, where leaves are darker than bark for the water in them
/// (order of magnitude; chosen).
const WOOD_REFLECTANCE: f64 = 0.5;
const LEAF_REFLECTANCE: f64 = 0.32;
const GROUND_REFLECTANCE: f64 = 0.35;
/// Relative deviation of the light of a ray (texture, speckle).
const TEXTURE: f64 = 0.12;
/// Range up to which the whole light of a target is received, m; beyond it falls with the square.
const REFERENCE_RANGE_M: f64 = 15.0;
/// Distance of surfaces from which a mean range counts as mixed, m.
const MIXED_M: f64 = 0.02;
/// Nearest range at which anything is measured, m.
const NEAREST_M: f64 = 0.6;

/// One return before range noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Echo {
    pub(crate) range: f64,
    /// Light relative to a white target across the beam, corrected for range.
    pub(crate) brightness: f64,
    pub(crate) owner: Owner,
    pub(crate) mixed: bool,
}

/// The beam of an instrument at a place.
#[derive(Debug)]
pub(crate) struct Beam<'a> {
    targets: &'a Targets,
    params: &'a ScanParams,
    origin: Vec3,
    /// Tangent of the angle between the axis and the outer rays, and their distance at the exit, m.
    spread: [f64; 2],
}

/// The end of one ray, and its light.
#[derive(Debug, Clone, Copy)]
struct Lit {
    hit: RayHit,
    light: f64,
}

impl<'a> Beam<'a> {
    pub(crate) fn new(targets: &'a Targets, params: &'a ScanParams, origin: Vec3) -> Self {
        let half_angle = 0.5e-3 * params.divergence_mrad;
        Self { targets, params, origin, spread: [OUTER * half_angle, OUTER * params.exit_radius_m] }
    }

    /// Replaces `echoes` by those of a pulse, nearest first.
    pub(crate) fn shoot(&self, direction: Vec3, stream: &mut Stream, echoes: &mut Vec<Echo>) {
        echoes.clear();
        if stream.chance(self.params.stray_share) {
            echoes.push(self.stray(stream));
            return;
        }
        let single = self.spread == [0.0; 2];
        let rays = self.rays(direction, stream);
        let range_m = self.params.max_range_m;
        let radius = self.spread[1] + self.spread[0] * range_m;
        let cast = if single { &rays[..1] } else { &rays[..] };
        let mut hits = self.targets.hits(cast, radius, range_m);
        if single {
            hits = [hits[0]; RAYS];
        }
        let lit = std::array::from_fn(|i| lit(hits[i]?, rays[i].direction, stream));
        self.group(lit, echoes);
    }

    /// The axis and four rays around it, turned at random.
    fn rays(&self, direction: Vec3, stream: &mut Stream) -> [Ray; RAYS] {
        let [u, v] = across(direction);
        let [cos, sin] = stream.direction();
        [[0.0, 0.0], [cos, sin], [-cos, -sin], [-sin, cos], [sin, -cos]].map(|[p, q]| {
            let aside = along(u.map(|value| value * p), v, q);
            let origin = along(self.origin, aside, self.spread[1]);
            Ray { origin, direction: unit(along(direction, aside, self.spread[0])) }
        })
    }

    /// Makes echoes of the ends of the rays: those within the mixing distance of the nearest one give
    /// their mean range, if the light suffices; until the resolution is reached the instrument is
    /// blind.
    fn group(&self, lit: [Option<Lit>; RAYS], echoes: &mut Vec<Echo>) {
        let mut ends: [Lit; RAYS] = match lit.iter().flatten().next() {
            Some(&any) => [any; RAYS],
            None => return,
        };
        let mut count = 0;
        for found in lit.into_iter().flatten() {
            ends[count] = found;
            count += 1;
        }
        let ends = &mut ends[..count];
        ends.sort_unstable_by(|a, b| a.hit.range.total_cmp(&b.hit.range));
        let mut first = 0;
        while first < count && echoes.len() < usize::from(self.params.max_returns) {
            let start = ends[first].hit.range;
            let within = |reach: f64| {
                first + ends[first..].iter().take_while(|e| e.hit.range - start <= reach).count()
            };
            let members = &ends[first..within(self.params.mixing_m)];
            match self.echo(members) {
                Some(echo) => {
                    echoes.push(echo);
                    first = within(self.params.resolution_m.max(self.params.mixing_m));
                }
                None => first += 1,
            }
        }
    }

    fn echo(&self, members: &[Lit]) -> Option<Echo> {
        let light: f64 = members.iter().map(|end| end.light).sum();
        let range = members.iter().map(|end| end.light * end.hit.range).sum::<f64>() / light;
        let spread = (REFERENCE_RANGE_M / range).min(1.0);
        if light * spread * spread < self.params.sensitivity {
            return None;
        }
        let brightest = members.iter().max_by(|a, b| a.light.total_cmp(&b.light))?;
        let deepest = members.last()?.hit.range - members.first()?.hit.range;
        let owner = brightest.hit.owner;
        Some(Echo { range, brightness: light, owner, mixed: deepest > MIXED_M })
    }

    fn stray(&self, stream: &mut Stream) -> Echo {
        let range = stream.within(1.0, 0.4 * self.params.max_range_m);
        let owner = Owner { tree: 0, label: Label::Stray, cylinder: NO_CYLINDER };
        Echo { range, brightness: 0.02, owner, mixed: false }
    }
}

/// The light of the end of a ray; none for what is too near.
fn lit(hit: RayHit, direction: Vec3, stream: &mut Stream) -> Option<Lit> {
    let reflectance = match hit.owner.label {
        Label::Wood => WOOD_REFLECTANCE,
        Label::Leaf | Label::Understorey | Label::Stray => LEAF_REFLECTANCE,
        Label::Ground => GROUND_REFLECTANCE,
    };
    let incidence = dot(hit.normal, direction).abs();
    let texture = (1.0 + TEXTURE * stream.bell()).max(0.2);
    let light = reflectance * incidence * texture / RAYS as f64;
    (hit.range >= NEAREST_M).then_some(Lit { hit, light })
}
