//! Field plots: what a crew would have measured in the scene, with its errors.

use crate::error::check;
use crate::random::{Domain, Stream};
use crate::tree::Layer;
use crate::{Error, Scene, Species, Tree};
use serde::{Deserialize, Serialize};

/// How trees are chosen around a plot's centre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum PlotKind {
    /// All trees within a distance.
    Fixed {
        /// The distance, m.
        radius_m: f64,
    },
    /// A tree counts when its stem looks wider than a fixed angle (Bitterlich 1948).
    Variable {
        /// Basal area per hectare for which every counted tree stands, m²/ha.
        baf_m2_per_ha: f64,
    },
}

impl PlotKind {
    /// Largest distance from the centre at which a tree counts, m.
    ///
    /// For variable plots `d/2 sqrt(10000 / BAF)` with `d` the diameter in metres, the metric form
    /// of the plot radius factor (Avery and Burkhart 2002, Forest measurements, chapter 11).
    #[must_use]
    pub fn limit_m(&self, dbh_cm: f64) -> f64 {
        match *self {
            Self::Fixed { radius_m } => radius_m,
            Self::Variable { baf_m2_per_ha } => dbh_cm / 200.0 * (10_000.0 / baf_m2_per_ha).sqrt(),
        }
    }

    /// Name in tables.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Fixed { .. } => "fixed",
            Self::Variable { .. } => "variable",
        }
    }
}

/// Where a plot is wanted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotSite {
    /// Name of the plot.
    pub name: String,
    /// Choice of trees.
    pub kind: PlotKind,
    /// True world position of its centre, m.
    pub centre_m: [f64; 2],
}

/// How a crew works.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Protocol {
    /// Smallest diameter that counts, cm.
    pub min_dbh_cm: f64,
    /// The height of the thickest tree and of every n-th other tree is measured.
    pub every_nth_height: u32,
    /// Deviation of the recorded centre in x and in y, m.
    pub position_error_m: f64,
    /// Deviation of diameters, cm.
    pub dbh_error_cm: f64,
    /// Relative deviation of heights.
    pub height_error: f64,
    /// Deviation of distances from the centre, m.
    pub distance_error_m: f64,
    /// Deviation of bearings, degrees.
    pub bearing_error_deg: f64,
}

impl Default for Protocol {
    fn default() -> Self {
        Self {
            min_dbh_cm: 10.0,
            every_nth_height: 3,
            position_error_m: 0.6,
            dbh_error_cm: 0.2,
            height_error: 0.025,
            distance_error_m: 0.06,
            bearing_error_deg: 1.0,
        }
    }
}

/// A measured tree.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldTree {
    /// Number in the plot, clockwise from north.
    pub number: u32,
    /// The tree in truth.
    pub tree_id: u32,
    /// Species.
    pub species: Species,
    /// Diameter at breast height, cm, to the millimetre.
    pub dbh_cm: f64,
    /// Total height where measured, m, to the decimetre.
    pub height_m: Option<f64>,
    /// Crown class as seen from below.
    pub crown_class: Layer,
    /// Horizontal distance of the stem from the centre, m.
    pub distance_m: f64,
    /// Direction of the stem from the centre, degrees clockwise from north.
    pub bearing_deg: f64,
}

/// A measured plot.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldPlot {
    /// The plot as wanted, with its true centre.
    pub site: PlotSite,
    /// The centre as the receiver gave it, world, m.
    pub recorded_centre_m: [f64; 2],
    /// Name of the stand at the centre; empty outside of all.
    pub stand: String,
    /// Smallest diameter that counted, cm.
    pub min_dbh_cm: f64,
    /// The trees.
    pub trees: Vec<FieldTree>,
}

/// Measures plots in a scene.
///
/// # Errors
/// [`Error::Parameter`] for a radius or basal area factor that is not positive.
pub fn measure(
    scene: &Scene,
    sites: &[PlotSite],
    protocol: &Protocol,
) -> Result<Vec<FieldPlot>, Error> {
    for site in sites {
        match site.kind {
            PlotKind::Fixed { radius_m } => {
                check("radius_m", radius_m, 0.1..=1000.0, "0.1 to 1000 m")?;
            }
            PlotKind::Variable { baf_m2_per_ha } => {
                check("baf_m2_per_ha", baf_m2_per_ha, 0.1..=100.0, "0.1 to 100 m2/ha")?;
            }
        }
    }
    let indexed = sites.iter().enumerate();
    Ok(indexed.map(|(index, site)| measure_plot(scene, index as u64, site, protocol)).collect())
}

fn measure_plot(scene: &Scene, index: u64, site: &PlotSite, protocol: &Protocol) -> FieldPlot {
    let mut stream = Stream::new(scene.params().seed, Domain::Plot, index);
    let [x, y, _] = scene.frame().local_from_world([site.centre_m[0], site.centre_m[1], 0.0]);
    let mut inside: Vec<(f64, f64, &Tree)> = Vec::new();
    for tree in scene.forest().trees.iter().filter(|tree| tree.dbh_cm >= protocol.min_dbh_cm) {
        let (dx, dy) = (tree.base_m[0] - x, tree.base_m[1] - y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance <= site.kind.limit_m(tree.dbh_cm) {
            inside.push((bearing_deg(dx, dy), distance, tree));
        }
    }
    inside.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.id.cmp(&b.2.id)));
    let recorded_centre_m = site
        .centre_m
        .map(|value| to_step(value + protocol.position_error_m * stream.normal(), 100.0));
    let thickest = inside.iter().map(|(_, _, tree)| tree.dbh_cm).fold(0.0, f64::max);
    let measured = inside.iter().enumerate().map(|(i, found)| {
        let with_height = found.2.dbh_cm == thickest
            || (i as u32).is_multiple_of(protocol.every_nth_height.max(1));
        measure_tree(i as u32 + 1, found, with_height, protocol, &mut stream)
    });
    let trees = measured.collect();
    let mut stands = scene.params().stands.iter();
    let stand = stands.find(|stand| stand.contains(site.centre_m[0], site.centre_m[1]));
    FieldPlot {
        site: site.clone(),
        recorded_centre_m,
        stand: stand.map(|stand| stand.name.clone()).unwrap_or_default(),
        min_dbh_cm: protocol.min_dbh_cm,
        trees,
    }
}

fn measure_tree(
    number: u32,
    &(bearing, distance, tree): &(f64, f64, &Tree),
    with_height: bool,
    protocol: &Protocol,
    stream: &mut Stream,
) -> FieldTree {
    let dbh_cm = to_step(tree.dbh_cm + protocol.dbh_error_cm * stream.normal(), 10.0);
    // Drawn for every tree, so that what is measured of one does not change another.
    let height_m = to_step(tree.height_m * (1.0 + protocol.height_error * stream.normal()), 10.0);
    let bearing = bearing + protocol.bearing_error_deg * stream.normal();
    FieldTree {
        number,
        tree_id: tree.id,
        species: tree.species,
        dbh_cm,
        height_m: with_height.then_some(height_m),
        crown_class: tree.layer,
        distance_m: to_step(distance + protocol.distance_error_m * stream.normal(), 100.0).max(0.0),
        bearing_deg: to_step(bearing.rem_euclid(360.0), 10.0) % 360.0,
    }
}

/// Rounds to steps of `1 / per_unit`.
fn to_step(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}

fn bearing_deg(east: f64, north: f64) -> f64 {
    libm::atan2(east, north).to_degrees().rem_euclid(360.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_variable_plots() {
        // BAF 4: plot radius factor 0.25 m per cm, so a tree of 40 cm counts up to 10 m.
        let kind = PlotKind::Variable { baf_m2_per_ha: 4.0 };
        assert!((kind.limit_m(40.0) - 10.0).abs() < 1e-12);
        // Each counted tree stands for BAF: basal area over the circle to its limit, per hectare.
        let (limit, basal) = (kind.limit_m(33.0), std::f64::consts::PI * 0.165 * 0.165);
        assert!((basal / (std::f64::consts::PI * limit * limit) * 10_000.0 - 4.0).abs() < 1e-12);
        assert_eq!(PlotKind::Fixed { radius_m: 11.28 }.limit_m(99.0), 11.28);
    }

    #[test]
    fn bearings_go_clockwise_from_north() {
        let round = |east, north| bearing_deg(east, north).round();
        assert_eq!(
            [round(0., 1.), round(1., 0.), round(0., -1.), round(-1., 0.)],
            [0., 90., 180., 270.]
        );
    }
}
