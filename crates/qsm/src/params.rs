//! Parameters of the stage.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where radii come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Fits to the points wherever there are enough, and what follows from them elsewhere.
    Fitted,
    /// The skeleton's own radii and axes, without a fit, as AdTree has them.
    Adtree,
}

/// Parameters of the cylinder model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Where radii come from.
    #[schemars(extend("x-source" = "fitted: this program; adtree: Du et al. 2019, section 2.3"))]
    pub method: Method,
    /// Length of a cylinder in radii, where the branch is straight.
    #[schemars(range(min = 1.0, max = 10.0), extend("x-unit" = "radii", "x-source" = "2 to 6: Raumonen et al. 2013, section 2.5"))]
    pub section_radii: f64,
    /// Cylinders are not shorter than this, however thin ...
    #[schemars(range(min = 0.005, max = 1.0), extend("x-unit" = "m"))]
    pub min_section_m: f64,
    /// ... and not longer than this, however thick, where the branch is straight.
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "m"))]
    pub max_section_m: f64,
    /// How far the skeleton may lie beside the axis of a cylinder, in radii.
    #[schemars(range(min = 0.05, max = 2.0), extend("x-unit" = "radii"))]
    pub max_bend_radii: f64,
    /// What points scatter across a surface, before the tree itself has told: ranging noise, footprint
    /// and bark.
    #[schemars(range(min = 0.0005, max = 0.1), extend("x-unit" = "m", "x-source" = "2 to 8 mm: terrestrial scanners on bark"))]
    pub noise_m: f64,
    /// Fewest points of a fit.
    #[schemars(range(min = 6, max = 200), extend("x-unit" = "points"))]
    pub min_points: u32,
    /// Largest standard error of a measured radius, as a share of it.
    #[schemars(range(min = 0.02, max = 0.6))]
    pub max_relative_sd: f64,
    /// Largest scatter of the points across a measured surface, as a share of its radius: the points
    /// of a ball of leaves scatter by a third of the radius of the circle through them.
    #[schemars(range(min = 0.02, max = 1.0))]
    pub max_relative_noise: f64,
    /// Most points inside a cylinder against those on its surface: wood is opaque.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub max_inside_share: f64,
    /// Fewest points on the surface against all points of the section.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub min_surface_share: f64,
    /// Radius of the thinnest twigs.
    #[schemars(range(min = 0.0005, max = 0.02), extend("x-unit" = "m", "x-source" = "twigs of temperate trees have diameters of 2 to 6 mm: Wilkes et al. 2021, table 1"))]
    pub min_radius_m: f64,
    /// Exponent of the pipe model, radius = a reach^exponent, before the tree's own branches have told.
    #[schemars(range(min = 0.3, max = 2.0), extend("x-source" = "1.1: Du et al. 2019, section 2.3; 1.5: elastic similarity, McMahon and Kronauer 1976"))]
    pub pipe_exponent: f64,
    /// Height of the diameter at breast height above the base.
    #[schemars(range(min = 0.1, max = 3.0), extend("x-unit" = "m", "x-source" = "1.3 m by convention of IUFRO"))]
    pub breast_height_m: f64,
    /// Thickness of the slices that the diameter at breast height is taken from.
    #[schemars(range(min = 0.02, max = 1.0), extend("x-unit" = "m", "x-source" = "10 to 20 cm are customary"))]
    pub slice_m: f64,
    /// Step of the taper table.
    #[schemars(range(min = 0.05, max = 10.0), extend("x-unit" = "m"))]
    pub taper_step_m: f64,
    /// Diameter from which branches count as thick.
    #[schemars(range(min = 0.005, max = 0.5), extend("x-unit" = "m"))]
    pub thick_m: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            method: Method::Fitted,
            section_radii: 3.5,
            min_section_m: 0.06,
            max_section_m: 0.6,
            max_bend_radii: 0.3,
            noise_m: 0.006,
            min_points: 6,
            max_relative_sd: 0.25,
            max_relative_noise: 0.2,
            max_inside_share: 0.15,
            min_surface_share: 0.45,
            min_radius_m: 0.002,
            pipe_exponent: 1.1,
            breast_height_m: 1.3,
            slice_m: 0.15,
            taper_step_m: 0.5,
            thick_m: 0.05,
        }
    }
}

impl Params {
    /// The skeleton's radii and axes as they are, for comparisons with AdTree.
    #[must_use]
    pub fn adtree() -> Self {
        Self { method: Method::Adtree, ..Self::default() }
    }

    /// What is wrong across fields, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        if self.min_section_m > self.max_section_m {
            wrong.push(format!(
                "`min_section_m` is {}, above `max_section_m` of {}",
                self.min_section_m, self.max_section_m
            ));
        }
        if 2.0 * self.min_radius_m > self.thick_m {
            wrong.push(format!(
                "`thick_m` is {}, below the diameter of the thinnest twigs, twice `min_radius_m` of {}",
                self.thick_m, self.min_radius_m
            ));
        }
        wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_sound() {
        assert_eq!(Params::default().check(), Vec::<String>::new());
        assert_eq!(Params::adtree().check(), Vec::<String>::new());
    }

    #[test]
    fn faults_are_named_with_their_value() {
        let wrong = Params { max_section_m: 0.05, thick_m: 0.001, ..Params::default() }.check();
        let text = wrong.join("; ");
        assert!(text.contains("`min_section_m` is 0.06, above `max_section_m` of 0.05"), "{text}");
        assert!(text.contains("`thick_m` is 0.001, below"), "{text}");
    }
}
