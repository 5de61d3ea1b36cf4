//! Parameters of the stage.

mod tree_labels;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use tree_labels::TreeLabelsParams;

/// Which points belong to a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Membership {
    /// Those on the crown's surface (the consensus set, as in Tittmann et al. 2011).
    Surface,
    /// Those on the crown's surface and all below it within the crown radius.
    Volume,
}

/// How points are given their trees. The trees themselves come from the stage `detection`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SegmentMethod {
    /// The crown model on or below whose surface a point lies (Tittmann et al. 2011).
    Starsac,
    /// Marker-controlled watershed on a pit-free canopy height model (Meyer 1994; Khosravipour et al. 2014).
    Watershed,
    /// Region growing on a pit-free canopy height model (Dalponte and Coomes 2016).
    Dalponte,
    /// Voronoi cells on a pit-free canopy height model (Silva et al. 2016).
    Silva,
    /// Growing from the top down by spacing in the plane (Li et al. 2012).
    Li,
    /// Normalized cut of a graph of voxels (Reitberger et al. 2009).
    Ncut,
}

impl SegmentMethod {
    /// All methods, in the sequence of tables.
    pub const ALL: [Self; 6] =
        [Self::Starsac, Self::Watershed, Self::Dalponte, Self::Silva, Self::Li, Self::Ncut];

    /// Its name in pipeline files and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Starsac => "starsac",
            Self::Watershed => "watershed",
            Self::Dalponte => "dalponte",
            Self::Silva => "silva",
            Self::Li => "li",
            Self::Ncut => "ncut",
        }
    }
}

/// Parameters of the stage `segmentation`.
///
/// Those of one method begin with its name; the others hold for several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentationParams {
    /// How points are given their trees.
    #[schemars(extend("x-source" = "as each method says"))]
    pub method: SegmentMethod,
    /// Edge of the squares in which a method works whose answer depends on more than a point's
    /// surroundings; they are fixed in the world, whole metres.
    #[schemars(range(min = 8, max = 1024), extend("x-unit" = "m", "x-source" = "this program"))]
    pub block_m: u32,
    /// For `starsac`, and trees below the canopy with other methods: which points belong to a tree.
    #[schemars(extend("x-source" = "Tittmann et al. 2011, section 3: surface; volume: this program"))]
    pub membership: Membership,
    /// Farthest a crown can reach from its apex; a wider one is an error. Half the diagonal of the
    /// windows of `crown-models` is always enough.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub reach_m: f64,
    /// Points lower than this above the ground belong to no tree.
    #[schemars(range(min = 0.0, max = 30.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub min_height_m: f64,
    /// With `membership = "volume"`, for `starsac` and trees below the canopy with other methods:
    /// points up to this far above the crown model still belong, for crowns are rougher than it.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub above_m: f64,
    /// Edge of the cells of the canopy height model.
    #[schemars(range(min = 0.1, max = 5.0), extend("x-unit" = "m", "x-source" = "Khosravipour et al. 2014 for 0.5 m and below"))]
    pub chm_cell_m: f64,
    /// Longest edge of the triangles of its layers above the ground.
    #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m", "x-source" = "Khosravipour et al. 2014, for the principle"))]
    pub chm_max_edge_m: f64,
    /// Distance of its layers from 5 m upwards; those below are at 0 and 2 m.
    #[schemars(range(min = 0.5, max = 50.0), extend("x-unit" = "m", "x-source" = "Khosravipour et al. 2014"))]
    pub chm_step_m: f64,
    /// For `watershed`, `dalponte` and `silva`: largest crown radius.
    #[schemars(range(min = 0.5, max = 30.0), extend("x-unit" = "m", "x-source" = "Dalponte and Coomes 2016: 10 cells of 1 m"))]
    pub raster_radius_m: f64,
    /// For all but `starsac`: points no further than this below the canopy height model are on the
    /// surface.
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub raster_surface_m: f64,
    /// For the same: a tree whose apex is further below the canopy height model has the points of its
    /// crown model instead.
    #[schemars(range(min = 0.1, max = 30.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub raster_hidden_m: f64,
    /// For `dalponte`: cells lower than this share of the apex are not of the crown.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-source" = "Dalponte and Coomes 2016"))]
    pub dalponte_seed_share: f64,
    /// For `dalponte`: cells lower than this share of the crown's mean height are not of the crown.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-source" = "Dalponte and Coomes 2016"))]
    pub dalponte_crown_share: f64,
    /// For `silva`: largest crown radius, as a share of the height.
    #[schemars(range(min = 0.01, max = 2.0), extend("x-source" = "Silva et al. 2016"))]
    pub silva_radius_share: f64,
    /// For `silva`: cells lower than this share of the apex are not of the crown.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-source" = "Silva et al. 2016"))]
    pub silva_least_share: f64,
    /// For `li`: spacing in the plane from which a point is of another tree, below
    /// `li_split_height_m`.
    #[schemars(range(min = 0.1, max = 20.0), extend("x-unit" = "m", "x-source" = "Li et al. 2012, section Segmentation: threshold"))]
    pub li_gap_low_m: f64,
    /// The same above it, where crowns are wider.
    #[schemars(range(min = 0.1, max = 20.0), extend("x-unit" = "m", "x-source" = "Li et al. 2012, section Segmentation: threshold"))]
    pub li_gap_high_m: f64,
    /// For `li`: height above which the larger spacing holds.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Li et al. 2012, section Segmentation: 15 m"))]
    pub li_split_height_m: f64,
    /// For `li`: farthest a tree reaches from its top.
    #[schemars(range(min = 0.5, max = 30.0), extend("x-unit" = "m", "x-source" = "this program: as raster_radius_m"))]
    pub li_radius_m: f64,
    /// For `ncut`: edge of the voxels in the plane.
    #[schemars(range(min = 0.2, max = 5.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009: 0.5 m; value: this program, set on simulated stands"))]
    pub ncut_voxel_m: f64,
    /// For `ncut`: height of the voxels.
    #[schemars(range(min = 0.2, max = 20.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009: 0.5 m; value: this program, set on simulated stands"))]
    pub ncut_voxel_height_m: f64,
    /// For `ncut`: voxels further apart in the plane are not compared.
    #[schemars(range(min = 0.5, max = 20.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009, for the principle; value: this program, set on simulated stands"))]
    pub ncut_radius_m: f64,
    /// For `ncut`: scale on which the likeness of voxels falls off in the plane.
    #[schemars(range(min = 0.1, max = 20.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009, for the principle; value: this program, set on simulated stands"))]
    pub ncut_sigma_xy_m: f64,
    /// For `ncut`: scale on which it falls off in height.
    #[schemars(range(min = 0.1, max = 100.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009, for the principle; value: this program, set on simulated stands"))]
    pub ncut_sigma_z_m: f64,
    /// For `ncut`: scale on which it falls off with the distance from the nearest treetop.
    #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m", "x-source" = "Reitberger et al. 2009, for the principle; value: this program, set on simulated stands"))]
    pub ncut_sigma_top_m: f64,
    /// For `ncut`: a cut with a larger normalised value is not made.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-source" = "Reitberger et al. 2009: 0.16"))]
    pub ncut_threshold: f64,
    /// For `ncut`: fewest voxels of what the static threshold cuts off.
    #[schemars(range(min = 1, max = 10000), extend("x-source" = "this program"))]
    pub ncut_min_voxels: u32,
    /// A program that takes the place of `method`: its words, such as `["python3", "hooks/x.py"]`; empty
    /// for none. Files among them count from the pipeline file's folder. See pipelines/hooks/README.md.
    pub command: Vec<String>,
    /// For `command`: its version. Change it whenever its answer could change for a reason that is not
    /// in the files named in `command`, whose contents count anyway.
    pub command_version: String,
    /// For `command`: surroundings of a tile that it is given besides, at least the largest crown radius.
    #[schemars(range(min = 0.0, max = 200.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub command_halo_m: f64,
    /// For `command`: it is killed when it has not ended after this time.
    #[schemars(range(min = 1, max = 604_800), extend("x-unit" = "s", "x-source" = "this program", "x-limit" = true))]
    pub command_time_limit_s: u32,
    /// For `command`: it is killed when it and all it started hold more memory.
    #[schemars(range(min = 10, max = 1_000_000), extend("x-unit" = "MB", "x-source" = "this program", "x-limit" = true))]
    pub command_memory_limit_mb: u32,
}

impl Default for SegmentationParams {
    fn default() -> Self {
        Self {
            method: SegmentMethod::Starsac,
            block_m: 64,
            membership: Membership::Volume,
            reach_m: 15.0,
            min_height_m: 1.0,
            above_m: 1.5,
            chm_cell_m: 0.5,
            chm_max_edge_m: 1.5,
            chm_step_m: 5.0,
            raster_radius_m: 10.0,
            raster_surface_m: 0.6,
            raster_hidden_m: 2.0,
            dalponte_seed_share: 0.45,
            dalponte_crown_share: 0.55,
            silva_radius_share: 0.6,
            silva_least_share: 0.3,
            li_gap_low_m: 1.5,
            li_gap_high_m: 2.0,
            li_split_height_m: 15.0,
            li_radius_m: 10.0,
            ncut_voxel_m: 0.75,
            ncut_voxel_height_m: 1.5,
            ncut_radius_m: 2.5,
            ncut_sigma_xy_m: 1.35,
            ncut_sigma_z_m: 5.0,
            ncut_sigma_top_m: 2.0,
            ncut_threshold: 0.16,
            ncut_min_voxels: 5,
            command: Vec::new(),
            command_version: String::new(),
            command_halo_m: 15.0,
            command_time_limit_s: 600,
            command_memory_limit_mb: 2000,
        }
    }
}

impl SegmentationParams {
    /// What is wrong with the values together: a tree may not reach further than `reach_m`, which
    /// those who fit crowns to its points rely on; a command begins with a program.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let radius = match self.method {
            SegmentMethod::Watershed | SegmentMethod::Dalponte | SegmentMethod::Silva => {
                Some(("raster_radius_m", self.raster_radius_m))
            }
            SegmentMethod::Li => Some(("li_radius_m", self.li_radius_m)),
            // Neither goes beyond `reach_m`.
            SegmentMethod::Starsac | SegmentMethod::Ncut => None,
        };
        let too_far = radius.filter(|(_, radius_m)| *radius_m > self.reach_m);
        let fault = |(name, radius_m): (&str, f64)| {
            format!(
                "{name} = {radius_m} exceeds reach_m = {}: raise it, also in crown-fit",
                self.reach_m
            )
        };
        let nameless = self.command.first().is_some_and(|program| program.trim().is_empty());
        let nameless =
            nameless.then(|| "`command` begins with an empty word; name a program".to_owned());
        too_far.map(fault).into_iter().chain(nameless).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_pipeline_files() {
        for method in SegmentMethod::ALL {
            let written = serde_json::to_value(method).unwrap();
            assert_eq!(written, method.name());
        }
        let schema = schemars::schema_for!(SegmentMethod).to_value();
        let named = schema["oneOf"].as_array().unwrap().len();
        assert_eq!(named, SegmentMethod::ALL.len(), "every method is listed");
    }

    #[test]
    fn a_radius_beyond_the_reach_is_refused_where_it_counts() {
        let wide = SegmentationParams { raster_radius_m: 20.0, ..SegmentationParams::default() };
        assert!(wide.check().is_empty(), "crown models have radii of their own");
        let wide = SegmentationParams { method: SegmentMethod::Silva, ..wide };
        assert!(wide.check()[0].contains("raster_radius_m = 20"), "{:?}", wide.check());
    }
}
