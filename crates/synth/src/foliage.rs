//! What a beam meets inside a crown.
//!
//! Foliage is a medium that lets a beam through with a probability, not a surface: density falls
//! towards the heart of the crown and between whorls, is broken into clumps with holes, and ends at
//! branches of uneven length. Beams find their way by free-flight sampling with null collisions
//! (Woodcock et al. 1965), which is exact for any density below its bound.

use crate::noise::gradient_noise;
use crate::random::{Stream, hash_cell, unit_of, whole};
use crate::species::Foliage;
use crate::{Crown, Tree};

/// Depth under the upper surface at which a crown is as thin as around its axis, m.
const HEART_M: f64 = 2.5;
/// Distance of dents as a share of the crown's longer semi-axis, and the smallest, m.
const DENT_OF_CROWN: f64 = 0.4;
const DENT_M: f64 = 1.2;
/// How steeply dents fall off, against gradient noise, whose values seldom leave ±0.4.
const CONTRAST: f64 = 1.25;

/// A beam or part of one: a position and a unit direction that goes down.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: [f64; 3],
    pub(crate) direction: [f64; 3],
}

impl Ray {
    pub(crate) fn at(&self, range: f64) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + range * self.direction[axis])
    }

    /// Descent per metre of range, positive.
    pub(crate) fn descent(&self) -> f64 {
        -self.direction[2]
    }

    /// Range at which the ray is at an elevation.
    pub(crate) fn range_at(&self, z: f64) -> f64 {
        (self.origin[2] - z) / self.descent()
    }
}

/// A tree as beams see it.
#[derive(Debug, Clone)]
pub(crate) struct Optics {
    crown: Crown,
    foliage: &'static Foliage,
    salt: u64,
    /// Cells of the clump lattice per unit of the crown's coordinates.
    clumps: [f64; 3],
    relief_m: f64,
    /// Dents of the envelope per unit of the crown's coordinates.
    dents: [f64; 2],
    whorls_per_m: f64,
    stem_base: [f64; 3],
    stem_axis: [f64; 2],
    stem_radius_m: f64,
}

/// A crown that a beam comes near, in coordinates of the crown: offset from its axis in units of
/// its semi-axes, as a straight line over the depth below the top.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passage {
    pub(crate) tree: u32,
    /// Range at the level of the top.
    pub(crate) top_range: f64,
    start: [f64; 2],
    slope: [f64; 2],
    /// Metres of range per metre of depth.
    stretch: f64,
}

impl Optics {
    pub(crate) fn new(tree: &Tree, salt: u64, crown_relief: f64) -> Self {
        let top = tree.crown.top_m;
        let per_metre = |axis: usize| (tree.base_m[axis] - top[axis]) / tree.height_m;
        let foliage = &tree.species.traits().foliage;
        let [a, b] = tree.crown.semi_axes_m;
        Self {
            crown: tree.crown,
            foliage,
            salt,
            clumps: [a, b, 1.0].map(|metres| metres / foliage.clump_m),
            relief_m: crown_relief * foliage.relief_m,
            dents: [a, b].map(|metres| metres / (DENT_OF_CROWN * a).max(DENT_M)),
            whorls_per_m: 1.0 / foliage.whorl_m,
            stem_base: tree.base_m,
            stem_axis: [per_metre(0), per_metre(1)],
            // Between breast height and the crown a stem is thinner than at breast height.
            stem_radius_m: 0.85 * tree.dbh_cm / 200.0,
        }
    }

    /// The beam's way past the crown; none when it stays away from it by more than a margin.
    pub(crate) fn passage(&self, tree: u32, ray: &Ray, margin_m: f64) -> Option<Passage> {
        let (crown, stretch) = (&self.crown, 1.0 / ray.descent());
        let top_range = ray.range_at(crown.top_m[2]);
        let [x, y, _] = ray.at(top_range);
        let start = crown.normalised(x - crown.top_m[0], y - crown.top_m[1]);
        let slope = crown.normalised(
            ray.direction[0] * stretch - crown.axis[0],
            ray.direction[1] * stretch - crown.axis[1],
        );
        let passage = Passage { tree, top_range, start, slope, stretch };
        let nearest = passage.nearest(start, 0.0, crown.upper_m + crown.lower_m);
        let limit = 1.0 + margin_m / crown.semi_axes_m[1];
        (nearest < limit * limit).then_some(passage)
    }

    /// Range at which a part of the beam, displaced in the plane, is thrown back by foliage, if that
    /// is nearer than `limit`.
    pub(crate) fn hit(
        &self,
        passage: &Passage,
        displaced: [f64; 2],
        limit: f64,
        stream: &mut Stream,
    ) -> Option<f64> {
        let crown = &self.crown;
        let [du, dv] = crown.normalised(displaced[0], displaced[1]);
        let start = [passage.start[0] + du, passage.start[1] + dv];
        let (mut depth, end) = passage.inside(start, crown.upper_m + crown.lower_m)?;
        let nearest = passage.nearest(start, depth, end).min(1.0).sqrt();
        depth = depth.max(crown.upper_m * crown.profile.depth(nearest));
        let end = end.min((limit - passage.top_range) / passage.stretch);
        if depth >= end {
            return None;
        }
        let flight = 1.0 / (self.foliage.extinction_per_m * passage.stretch);
        loop {
            depth += stream.flight() * flight;
            if depth >= end {
                return None;
            }
            let u = start[0] + depth * passage.slope[0];
            let v = start[1] + depth * passage.slope[1];
            let density = self.density(u, v, depth);
            if density > 0.0 && stream.chance(density) {
                return Some(passage.top_range + depth * passage.stretch);
            }
        }
    }

    /// Foliage density relative to the largest of its species.
    fn density(&self, u: f64, v: f64, depth: f64) -> f64 {
        let (crown, foliage) = (&self.crown, self.foliage);
        let cell = [u * self.clumps[0], v * self.clumps[1], depth * self.clumps[2]].map(whole);
        if unit_of(hash_cell(cell, !self.salt)) < foliage.porosity {
            return 0.0;
        }
        let rho = (u * u + v * v).sqrt();
        let storey = (depth - foliage.droop * rho * crown.semi_axes_m[0]) * self.whorls_per_m;
        let whorl = whole(storey);
        let branch = hash_cell([whorl, octant(u, v), 0], self.salt);
        let reach = rho * (1.0 + foliage.roughness * unit_of(branch));
        let below = depth - crown.upper_m;
        if reach >= 1.0 || (below > 0.0 && below > crown.lower_m * (1.0 - reach * reach).sqrt()) {
            return 0.0;
        }
        let surface = crown.upper_m * crown.profile.depth(reach);
        let under_surface = depth - surface - self.dent_m(u, v);
        if under_surface < 0.0 {
            return 0.0;
        }
        let outside = (reach * reach).max(1.0 - under_surface * (1.0 / HEART_M));
        let between = 1.0 - (2.0 * (storey - f64::from(whorl)) - 1.0).abs();
        (foliage.inner + (1.0 - foliage.inner) * outside) * (1.0 - foliage.layering * between)
    }

    /// How far the foliage stays below the smooth envelope, m.
    fn dent_m(&self, u: f64, v: f64) -> f64 {
        if self.relief_m == 0.0 {
            return 0.0;
        }
        let (value, _) = gradient_noise(u * self.dents[0], v * self.dents[1], self.salt);
        self.relief_m * (0.5 + CONTRAST * value).clamp(0.0, 1.0)
    }

    /// Range at which a part of the beam meets the stem below the crown, if nearer than `limit`.
    pub(crate) fn stem_hit(&self, ray: &Ray, displaced: [f64; 2], limit: f64) -> Option<f64> {
        let (stretch, base) = (1.0 / ray.descent(), &self.stem_base);
        let foot = ray.at(ray.range_at(base[2]));
        // Offset from the stem's axis over the height above its base.
        let start = [foot[0] + displaced[0] - base[0], foot[1] + displaced[1] - base[1]];
        let slope = [0, 1].map(|i| self.stem_axis[i] - ray.direction[i] * stretch);
        let (a, b) =
            (slope[0] * slope[0] + slope[1] * slope[1], start[0] * slope[0] + start[1] * slope[1]);
        let c = start[0] * start[0] + start[1] * start[1] - self.stem_radius_m * self.stem_radius_m;
        let root = b * b - a * c;
        if root <= 0.0 || a < 1e-12 {
            return None;
        }
        let above = (root.sqrt() - b) / a;
        let range = ray.range_at(base[2] + above);
        let on_stem = above > 0.0 && base[2] + above < self.crown.base_z_m() && range < limit;
        on_stem.then_some(range)
    }

    /// Share of light that the tree's foliage throws back.
    pub(crate) fn reflectance(&self) -> f64 {
        self.foliage.reflectance
    }
}

impl Passage {
    /// Smallest squared normalised distance from the axis over a range of depths.
    fn nearest(&self, start: [f64; 2], from: f64, to: f64) -> f64 {
        let [su, sv] = self.slope;
        let (a, b) = (su * su + sv * sv, start[0] * su + start[1] * sv);
        let depth = if a > 1e-12 { (-b / a).clamp(from, to) } else { from };
        let (u, v) = (start[0] + depth * su, start[1] + depth * sv);
        u * u + v * v
    }

    /// Depths between which the normalised distance from the axis is below 1.
    fn inside(&self, start: [f64; 2], length: f64) -> Option<(f64, f64)> {
        let [su, sv] = self.slope;
        let (a, b) = (su * su + sv * sv, start[0] * su + start[1] * sv);
        let c = start[0] * start[0] + start[1] * start[1] - 1.0;
        if a < 1e-12 {
            return (c < 0.0).then_some((0.0, length));
        }
        let root = b * b - a * c;
        if root <= 0.0 {
            return None;
        }
        let half = root.sqrt();
        let (enter, leave) = (((-b - half) / a).max(0.0), ((half - b) / a).min(length));
        (enter < leave).then_some((enter, leave))
    }
}

/// Which eighth of a full turn a direction lies in.
fn octant(u: f64, v: f64) -> i32 {
    i32::from(u < 0.0) + 2 * i32::from(v < 0.0) + 4 * i32::from(u.abs() < v.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Species;
    use crate::crown::tests::leaning;
    use crate::random::Domain;
    use crate::tree::Layer;

    fn tree() -> Tree {
        Tree {
            id: 1,
            stand: 0,
            species: Species::DouglasFir,
            dbh_cm: 40.0,
            height_m: 25.0,
            base_m: [9.0, -4.0, 105.0],
            crown: leaning(),
            ground_below_top_m: 105.0,
            exposed: 1.0,
            visible: true,
            layer: Layer::Dominant,
        }
    }

    #[test]
    fn hits_lie_in_the_crown_and_holes_let_beams_through() {
        let optics = Optics::new(&tree(), 9, 0.0);
        let mut stream = Stream::new(3, Domain::Pulse, 0);
        let (mut hits, mut through) = (0, 0);
        for i in 0..4000 {
            let at = [7.0 + f64::from(i % 60) * 0.1, -7.0 + f64::from(i / 60) * 0.1];
            let direction = [0.2, -0.1, -(1.0_f64 - 0.05).sqrt()];
            let mut ray = Ray { origin: [at[0], at[1], 120.0], direction };
            ray.origin = ray.at(-300.0);
            let Some(passage) = optics.passage(0, &ray, 0.0) else { continue };
            match optics.hit(&passage, [0.0; 2], f64::INFINITY, &mut stream) {
                Some(range) => {
                    assert!(leaning().contains(ray.at(range), 1e-9), "{:?}", ray.at(range));
                    hits += 1;
                }
                None => through += 1,
            }
        }
        assert!(hits > 1200 && through > 200, "{hits} {through}");
    }

    #[test]
    fn dents_take_foliage_away_and_put_none_where_none_was() {
        let [smooth, dented] = [0.0, 1.0].map(|relief| Optics::new(&tree(), 9, relief));
        let (mut taken, mut kept) = (0, 0);
        for i in 0..8000 {
            let [u, v] = [f64::from(i % 20), f64::from(i / 20 % 20)].map(|k| 0.1 * (k - 9.5));
            let depth = 0.5 * f64::from(i / 400);
            let densities = [&smooth, &dented].map(|optics| optics.density(u, v, depth));
            assert!(densities[1] == 0.0 || densities[0] > 0.0, "{u} {v} {depth}: {densities:?}");
            taken += u32::from(densities[1] == 0.0 && densities[0] > 0.0);
            kept += u32::from(densities[1] > 0.0);
        }
        assert!(taken > 20 && kept > 5 * taken, "{taken} {kept}");
    }

    #[test]
    fn a_stem_is_hit_on_its_surface() {
        let (tree, optics) = (tree(), Optics::new(&tree(), 9, 0.0));
        let direction = [0.3, 0.0, -(1.0_f64 - 0.09).sqrt()];
        let mut ray = Ray { origin: [9.0, -4.0, 108.0], direction };
        ray.origin = ray.at(-200.0);
        let range = optics.stem_hit(&ray, [0.0; 2], f64::INFINITY).unwrap();
        let [x, y, z] = ray.at(range);
        let up = (z - tree.base_m[2]) / tree.height_m;
        let axis = [9.0 + up * 1.0, -4.0];
        let distance = libm::hypot(x - axis[0], y - axis[1]);
        assert!((distance - 0.17).abs() < 1e-9 && range < 200.0, "{distance} {range}");
        assert_eq!(optics.stem_hit(&ray, [0.0, 0.5], f64::INFINITY), None);
    }

    #[test]
    fn octants_divide_the_turn() {
        let octants: std::collections::BTreeSet<i32> = (0..8)
            .map(|eighth| {
                let at =
                    |degrees: f64| libm::sincos((f64::from(eighth) * 45.0 + degrees).to_radians());
                let ((sin, cos), (later_sin, later_cos)) = (at(1.0), at(44.0));
                assert_eq!(octant(cos, sin), octant(later_cos, later_sin));
                octant(cos, sin)
            })
            .collect();
        assert_eq!(octants.len(), 8);
    }
}
