//! Parameters of the stage.

use crate::operator::{Settings, Weights};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How points are consolidated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Weighted locally optimal projection.
    Wlop,
    /// Not at all.
    None,
}

/// Parameters of consolidation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConsolidationParams {
    /// How points are consolidated.
    #[schemars(extend("x-source" = "Huang et al. 2009; Lipman et al. 2007"))]
    pub method: Method,
    /// As the paper does it: one radius h = 4 sqrt(d/m) for the stem and one for the rest (d: diagonal
    /// of the bounding box, m: number of points), `share` of the points, all iterations, theta/r as weights and
    /// theta to its end, and the result taken whatever it is. Of the fields below only `share` and
    /// `min_points` are used.
    #[schemars(extend("x-source" = "Huang et al. 2009, section 3"))]
    pub paper: bool,
    /// Weight of the repulsion that spreads points evenly, and keeps them from becoming thin: at 0.45 the
    /// points of TreeLS pine become 3.3 mm thin, at 0.25 1.9 mm, at 0.1 1.2 mm, from 5.4 mm. The
    /// paper's mode has 0.45.
    #[schemars(range(min = 0.0, max = 0.499), extend("x-source" = "range: Huang et al. 2009; value: measured, least mean distance on TreeLS pine and AdTree tree1"))]
    pub mu: f64,
    /// Most iterations. The paper's mode makes 50, always.
    #[schemars(range(min = 1, max = 1000), extend("x-source" = "Huang et al. 2009: 50"))]
    pub iterations: u32,
    /// Iterations end when points move less than this share of their radius h, in the mean.
    #[schemars(range(min = 0.0, max = 0.1), extend("x-source" = "this program: a thousandth of h is 0.05 mm at a spacing of 1 cm"))]
    pub still_ratio: f64,
    /// Radius h over the local spacing of points.
    #[schemars(range(min = 2.0, max = 50.0), extend("x-source" = "measured with CGAL, whose radius is h/2: 2 to 3 spacings help, 8 destroy"))]
    pub radius_spacings: f64,
    /// Largest radius h over the local radius of the branch. A cylinder's radius shrinks by
    /// (1 - mu)/64 of this, squared: by 0.9 % at 1.
    #[schemars(range(min = 0.1, max = 3.0), extend("x-source" = "this program, from the second moments of theta/r"))]
    pub branch_radius_share: f64,
    /// Where the branch allows no radius h of this many spacings, points are left alone: there is
    /// nothing to take a mean of.
    #[schemars(range(min = 1.0, max = 20.0), extend("x-source" = "this program: at 3 spacings h/4 is below one spacing"))]
    pub min_radius_spacings: f64,
    /// Edge of the cells of which one point is kept, over h (the next lower power of two of metres);
    /// 0 keeps all points.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-source" = "this program: a cell of about a spacing"))]
    pub thinning_ratio: f64,
    /// Paper's mode: share of points kept, drawn at random.
    #[schemars(range(min = 0.01, max = 1.0), extend("x-source" = "this program; the paper gives none"))]
    pub share: f64,
    /// Fewer distinct points than this are not consolidated.
    #[schemars(range(min = 10, max = 1_000_000), extend("x-unit" = "points", "x-source" = "this program"))]
    pub min_points: u32,
    /// Clouds thinner than this already are not consolidated.
    #[schemars(range(min = 0.0, max = 0.1), extend("x-unit" = "m", "x-source" = "measured: consolidated clouds of real trees are 1.9 mm thick and more, docs/consolidation-experiment.md; thinner ones have nothing to gain"))]
    pub noise_floor_m: f64,
    /// Where the mean distance from the points before to the surface through those after rises above
    /// this many times what it was, points are left as they were.
    #[schemars(range(min = 0.5, max = 10.0), extend("x-source" = "this program"))]
    pub worst_distance_ratio: f64,
}

impl Default for ConsolidationParams {
    fn default() -> Self {
        Self {
            method: Method::Wlop,
            paper: false,
            mu: 0.25,
            iterations: 50,
            still_ratio: 0.001,
            radius_spacings: 5.0,
            branch_radius_share: 1.0,
            min_radius_spacings: 3.0,
            thinning_ratio: 0.2,
            share: 0.5,
            min_points: 200,
            noise_floor_m: 0.0015,
            worst_distance_ratio: 1.0,
        }
    }
}

impl ConsolidationParams {
    /// The paper's mode.
    #[must_use]
    pub fn paper() -> Self {
        Self { paper: true, ..Self::default() }
    }

    /// How the operator is applied.
    #[must_use]
    pub fn settings(&self) -> Settings {
        /// Huang et al. 2009.
        const PAPER: Settings = Settings {
            weights: Weights::Paper,
            mu: 0.45,
            iterations: 50,
            reach_ratio: 1.0,
            still_ratio: 0.0,
        };
        if self.paper {
            return PAPER;
        }
        // Beyond h/2 theta is below exp(-4); CGAL ends it there, too.
        let Self { mu, iterations, still_ratio, .. } = *self;
        Settings { weights: Weights::Even, mu, iterations, reach_ratio: 0.5, still_ratio }
    }

    /// What is wrong across fields or out of range, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        for (name, value, low, high) in self.ranges() {
            if !(low..=high).contains(&value) {
                wrong.push(format!("`{name}` is {value}, allowed are {low} to {high}"));
            }
        }
        if self.min_radius_spacings > self.radius_spacings {
            wrong.push(format!(
                "`min_radius_spacings` is {}, above `radius_spacings` of {}",
                self.min_radius_spacings, self.radius_spacings
            ));
        }
        wrong
    }

    fn ranges(&self) -> [(&'static str, f64, f64, f64); 11] {
        [
            ("mu", self.mu, 0.0, 0.499),
            ("iterations", f64::from(self.iterations), 1.0, 1000.0),
            ("still_ratio", self.still_ratio, 0.0, 0.1),
            ("radius_spacings", self.radius_spacings, 2.0, 50.0),
            ("branch_radius_share", self.branch_radius_share, 0.1, 3.0),
            ("min_radius_spacings", self.min_radius_spacings, 1.0, 20.0),
            ("thinning_ratio", self.thinning_ratio, 0.0, 1.0),
            ("share", self.share, 0.01, 1.0),
            ("min_points", f64::from(self.min_points), 10.0, 1_000_000.0),
            ("noise_floor_m", self.noise_floor_m, 0.0, 0.1),
            ("worst_distance_ratio", self.worst_distance_ratio, 0.5, 10.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_presets_are_sound() {
        for params in [ConsolidationParams::default(), ConsolidationParams::paper()] {
            assert_eq!(params.check(), Vec::<String>::new());
            assert_eq!(params.settings().check(), Vec::<String>::new());
        }
    }

    #[test]
    fn the_ranges_are_those_of_the_schema() {
        let schema = schemars::schema_for!(ConsolidationParams).to_value();
        for (name, _, low, high) in ConsolidationParams::default().ranges() {
            let property = &schema["properties"][name];
            assert_eq!(property["minimum"].as_f64(), Some(low), "{name}");
            assert_eq!(property["maximum"].as_f64(), Some(high), "{name}");
        }
    }

    #[test]
    fn each_fault_is_named_with_its_value() {
        let params = ConsolidationParams {
            mu: f64::NAN,
            min_radius_spacings: 9.0,
            ..ConsolidationParams::default()
        };
        let wrong = params.check().join("; ");
        assert!(wrong.contains("`mu` is NaN") && wrong.contains("is 9, above"), "{wrong}");
    }
}
