//! Parameters of the stage.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Narrower windows could leave two treetops in one cell of 0.1 m and so with the same tree id.
const SMALLEST_WINDOW_M: f64 = 0.3;

/// How treetops are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// By what the points around a candidate say, also below other crowns.
    Evidence,
    /// Highest points of their windows.
    Window,
}

/// Shape and size of the window in which a treetop must be the highest point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum WindowKind {
    /// A circle whose diameter grows with the height of the point.
    Variable,
    /// A circle of fixed diameter.
    Circle,
    /// A square of fixed edge, parallel to the axes.
    Square,
}

/// Which returns may be treetops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Returns {
    /// First returns only; a return number of 0 (not recorded) counts as first.
    First,
    /// Every return.
    All,
}

/// What makes one point rank above another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RankBy {
    /// Height above ground. On slopes the maxima of a crown move downhill.
    Height,
    /// Elevation. On slopes the maxima stay at the apex; with windows not much wider than a crown
    /// the higher ground uphill does no harm (`by_density_and_slope` in tests/stands.rs compares).
    Elevation,
}

/// Parameters of the treetop detection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// How treetops are found. The parameters of the window and of prominence serve the method
    /// `window`, those of candidates, score and distance the method `evidence`. With either they are
    /// candidates, of which the stage `detection` chooses; its `min_score = 0` keeps them all.
    #[schemars(extend("x-source" = "window: Tittmann et al. 2011, section 3; evidence: this program"))]
    pub method: Method,
    /// Evidence: a candidate has no point above it within this radius in the plane ...
    #[schemars(range(min = 0.1, max = 3.0), extend("x-unit" = "m", "x-source" = "this program; the model behind the score was found with it"))]
    pub candidate_radius_m: f64,
    /// ... and within this height; what is higher hangs over it.
    #[schemars(range(min = 0.5, max = 20.0), extend("x-unit" = "m", "x-source" = "this program; the model behind the score was found with it"))]
    pub candidate_gap_m: f64,
    /// Evidence: candidates less sure to be the top of a tree are left out. This keeps the work
    /// small; what is a tree is decided by `min_score` of the stage `detection`.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1", "x-source" = "this program"))]
    pub min_score: f64,
    /// Evidence: of two candidates nearer than this in the plane the better stands ...
    #[schemars(range(min = 0.1, max = 5.0), extend("x-unit" = "m", "x-source" = "this program; set on simulated stands, no command varies it"))]
    pub apart_m: f64,
    /// ... and the more for each metre of the candidate's height ...
    #[schemars(range(min = 0.0, max = 0.1), extend("x-unit" = "m/m", "x-source" = "this program; set on simulated stands, no command varies it"))]
    pub apart_per_height: f64,
    /// ... unless they are further apart than this in elevation ...
    #[schemars(range(min = 0.5, max = 30.0), extend("x-unit" = "m", "x-source" = "this program; set on simulated stands, no command varies it"))]
    pub apart_vertical_m: f64,
    /// ... and the more for each metre of height.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m/m", "x-source" = "this program; set on simulated stands, no command varies it"))]
    pub apart_vertical_per_height: f64,
    /// Shape and size of the window.
    #[schemars(extend("x-source" = "variable: Popescu and Wynne 2004; square: Tittmann et al. 2011, section 3"))]
    pub window: WindowKind,
    /// Diameter of the circle or edge of the square; not used by the variable window.
    #[schemars(range(min = 0.3, max = 50.0), extend("x-unit" = "m", "x-source" = "Tittmann et al. 2011, section 3"))]
    pub window_m: f64,
    /// Variable window: diameter at height 0.
    #[schemars(range(min = 0.3, max = 50.0), extend("x-unit" = "m", "x-source" = "form: Popescu and Wynne 2004; value: measured as `window_min_spacings`"))]
    pub window_base_m: f64,
    /// Variable window: growth of the diameter per metre of height.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m/m", "x-source" = "form: Popescu and Wynne 2004; value: measured as `window_min_spacings`"))]
    pub window_per_height: f64,
    /// Variable window: largest diameter.
    #[schemars(range(min = 0.3, max = 50.0), extend("x-unit" = "m"))]
    pub window_max_m: f64,
    /// Variable window: its diameter is at least this many mean spacings of the first returns
    /// around the point (within 5 m), as far as the largest diameter allows: a narrower window holds
    /// too few points to tell a crown from one of its branches. 0 switches it off.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-source" = "measured on simulated stands of five kinds with 2 to 50 pulses per square metre (tests/stands.rs)"))]
    pub window_min_spacings: f64,
    /// Smallest height above ground of a treetop; 0 switches the test off.
    #[schemars(range(min = 0.0, max = 50.0), extend("x-unit" = "m", "x-source" = "the customary 2 m of airborne inventories; lidR's default too"))]
    pub min_height_m: f64,
    /// Points higher above ground than this are no vegetation and do not take part.
    #[schemars(range(min = 1.0, max = 10_000.0), extend("x-unit" = "m", "x-source" = "the tallest known tree measures 116 m (Sequoia sempervirens `Hyperion`)"))]
    pub max_height_m: f64,
    /// Which returns may be treetops. Every return can outrank them.
    pub returns: Returns,
    /// What makes one point rank above another.
    pub rank_by: RankBy,
    /// How far a top must rise above the highest path to anything higher; 0 switches the test off.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-unit" = "m", "x-source" = "measured on simulated stands of five kinds with 2 to 50 pulses per square metre (tests/stands.rs)"))]
    pub min_prominence_m: f64,
    /// The same as a share of the height of the top; the larger of the two counts.
    #[schemars(range(min = 0.0, max = 0.9), extend("x-source" = "measured on simulated stands of five kinds with 2 to 50 pulses per square metre (tests/stands.rs)"))]
    pub min_prominence_ratio: f64,
    /// How far around a top paths to higher points are sought.
    #[schemars(range(min = 0.5, max = 25.0), extend("x-unit" = "m"))]
    pub prominence_reach_m: f64,
    /// Other points that must lie within the support radius for a point to take part; 0 takes all.
    #[schemars(range(min = 0, max = 100))]
    pub support_points: u32,
    /// Radius of the sphere in which the supporting points are counted.
    #[schemars(range(min = 0.1, max = 10.0), extend("x-unit" = "m"))]
    pub support_radius_m: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            method: Method::Evidence,
            candidate_radius_m: 0.75,
            candidate_gap_m: 2.0,
            min_score: 0.1,
            apart_m: 0.6,
            apart_per_height: 0.03,
            apart_vertical_m: 3.0,
            apart_vertical_per_height: 0.1,
            window: WindowKind::Variable,
            window_m: 1.5,
            window_base_m: 1.5,
            window_per_height: 0.02,
            window_max_m: 8.0,
            window_min_spacings: 4.5,
            min_height_m: 2.0,
            max_height_m: 130.0,
            returns: Returns::All,
            rank_by: RankBy::Elevation,
            min_prominence_m: 0.7,
            min_prominence_ratio: 0.0,
            prominence_reach_m: 5.0,
            support_points: 2,
            support_radius_m: 3.0,
        }
    }
}

impl Params {
    /// Highest points of windows that grow with height, with prominence and support.
    #[must_use]
    pub fn by_window() -> Self {
        Self { method: Method::Window, ..Self::default() }
    }

    /// Tittmann et al. 2011, section 3: first returns that are not ground and higher than every
    /// point in a square of 1.5 m around them, and nothing else.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            window: WindowKind::Square,
            window_m: 1.5,
            min_height_m: 0.0,
            returns: Returns::First,
            rank_by: RankBy::Elevation,
            ..Self::maxima_only()
        }
    }

    /// A circle of the given diameter, all returns from 2 m up ranked by height: `lmf` of lidR.
    #[must_use]
    pub fn fixed_circle(diameter_m: f64) -> Self {
        Self {
            window: WindowKind::Circle,
            window_m: diameter_m,
            rank_by: RankBy::Height,
            ..Self::maxima_only()
        }
    }

    fn maxima_only() -> Self {
        Self {
            max_height_m: 10_000.0,
            window_min_spacings: 0.0,
            min_prominence_m: 0.0,
            min_prominence_ratio: 0.0,
            support_points: 0,
            ..Self::by_window()
        }
    }

    /// How far from a point its being a treetop can depend on others, in metres.
    #[must_use]
    pub fn halo_m(&self) -> f64 {
        let support_m = if self.support_points > 0 { self.support_radius_m } else { 0.0 };
        if self.method == Method::Evidence {
            return crate::evidence::REACH_M + support_m + self.largest_apart_m();
        }
        self.largest_reach_m().max(crate::prominence::halo_m(self.prominence_reach_m)) + support_m
    }

    fn largest_apart_m(&self) -> f64 {
        (self.apart_m + self.apart_per_height * self.max_height_m).max(SMALLEST_WINDOW_M)
    }

    /// Half the largest diagonal or diameter of a window, or as far as its size depends on points.
    fn largest_reach_m(&self) -> f64 {
        match self.window {
            WindowKind::Variable if self.window_min_spacings > 0.0 => {
                (self.window_max_m / 2.0).max(crate::maxima::SPACING_HALO_M)
            }
            WindowKind::Variable => self.window_max_m / 2.0,
            WindowKind::Circle => self.window_m / 2.0,
            WindowKind::Square => self.window_m * std::f64::consts::FRAC_1_SQRT_2,
        }
    }

    /// What is wrong across fields or out of range, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        for (name, value, low, high) in self.ranges() {
            if !(value >= low && value <= high) {
                wrong.push(format!("`{name}` is {value}, allowed are {low} to {high}"));
            }
        }
        if self.window_max_m < self.window_base_m {
            wrong.push(format!(
                "`window_max_m` is {}, below `window_base_m` of {}",
                self.window_max_m, self.window_base_m
            ));
        }
        if self.max_height_m <= self.min_height_m {
            wrong.push(format!(
                "`max_height_m` is {}, not above `min_height_m` of {}",
                self.max_height_m, self.min_height_m
            ));
        }
        wrong
    }

    fn ranges(&self) -> [(&'static str, f64, f64, f64); 18] {
        [
            ("candidate_radius_m", self.candidate_radius_m, 0.1, 3.0),
            ("candidate_gap_m", self.candidate_gap_m, 0.5, 20.0),
            ("min_score", self.min_score, 0.0, 1.0),
            ("apart_m", self.apart_m, 0.1, 5.0),
            ("apart_per_height", self.apart_per_height, 0.0, 0.1),
            ("apart_vertical_m", self.apart_vertical_m, 0.5, 30.0),
            ("apart_vertical_per_height", self.apart_vertical_per_height, 0.0, 1.0),
            ("window_m", self.window_m, SMALLEST_WINDOW_M, 50.0),
            ("window_base_m", self.window_base_m, SMALLEST_WINDOW_M, 50.0),
            ("window_per_height", self.window_per_height, 0.0, 1.0),
            ("window_max_m", self.window_max_m, SMALLEST_WINDOW_M, 50.0),
            ("window_min_spacings", self.window_min_spacings, 0.0, 20.0),
            ("min_height_m", self.min_height_m, 0.0, 50.0),
            ("max_height_m", self.max_height_m, 1.0, 10_000.0),
            ("min_prominence_m", self.min_prominence_m, 0.0, 20.0),
            ("min_prominence_ratio", self.min_prominence_ratio, 0.0, 0.9),
            ("prominence_reach_m", self.prominence_reach_m, 0.5, 25.0),
            ("support_radius_m", self.support_radius_m, 0.1, 10.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_presets_are_sound() {
        for params in [Params::default(), Params::paper(), Params::fixed_circle(3.0)] {
            assert_eq!(params.check(), Vec::<String>::new());
        }
    }

    #[test]
    fn the_ranges_are_those_of_the_schema() {
        let schema = schemars::schema_for!(Params).to_value();
        for (name, _, low, high) in Params::default().ranges() {
            let property = &schema["properties"][name];
            assert_eq!(property["minimum"].as_f64(), Some(low), "{name}");
            assert_eq!(property["maximum"].as_f64(), Some(high), "{name}");
        }
    }

    #[test]
    fn each_fault_is_named_with_its_value() {
        let params = Params { window_m: f64::NAN, max_height_m: 1.5, ..Params::default() };
        let wrong = params.check();
        assert!(wrong[0].contains("`window_m` is NaN"), "{wrong:?}");
        assert!(wrong[1].contains("`max_height_m` is 1.5, not above"), "{wrong:?}");
    }

    #[test]
    fn the_halo_covers_window_prominence_and_support() {
        let wide = Params { window_max_m: 30.0, support_points: 0, ..Params::by_window() };
        assert_eq!(wide.halo_m(), 15.0);
        let window = Params::by_window();
        assert!(window.halo_m() >= window.prominence_reach_m + 3.0);
        let evidence = Params::default();
        assert!(evidence.halo_m() >= crate::evidence::REACH_M + evidence.support_radius_m + 0.6);
    }
}
