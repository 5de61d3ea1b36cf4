//! What foresters take away about a tree.

use crate::dbh::{Dbh, TaperStep, dbh, taper};
use crate::hull::hull_area_m2;
use crate::measure::Owned;
use crate::{Model, ModelBranch, Params};
use std::f64::consts::PI;

/// Figures of one tree.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metrics {
    /// Diameter at breast height.
    pub dbh: Option<Dbh>,
    /// Height of the highest point above the base, m.
    pub height_m: f64,
    /// Height above the base at which the crown's lowest branch leaves the stem, m.
    pub crown_base_m: Option<f64>,
    /// Area of the convex hull of the crown's points seen from above, m2.
    pub crown_area_m2: f64,
    /// Diameter of the circle with that area, m.
    pub crown_diameter_m: f64,
    /// Volume of the stem, m3.
    pub stem_volume_m3: f64,
    /// Volume of cylinders of branches from [`Params::thick_m`] of diameter on, m3.
    pub thick_volume_m3: f64,
    /// Volume of thinner cylinders of branches, m3.
    pub thin_volume_m3: f64,
    /// Lateral surface of all cylinders, m2.
    pub surface_m2: f64,
    /// Length of all cylinders, m.
    pub length_m: f64,
    /// Diameter of the stem by height.
    pub taper: Vec<TaperStep>,
}

/// Branches of one order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OrderRow {
    /// 0 for the stem.
    pub order: u16,
    /// Number of branches.
    pub branches: u32,
    /// Number of cylinders.
    pub cylinders: u32,
    /// Length of them, m.
    pub length_m: f64,
    /// Volume of them, m3.
    pub volume_m3: f64,
}

/// A branch makes part of the crown from this length on, m ...
const CROWN_BRANCH_M: f64 = 0.5;
/// ... or this share of the tree's height, if that is less.
const CROWN_BRANCH_SHARE: f64 = 0.05;
/// The crown ends where the stem bears no branch over this share of the tree's height, and 1 m: what
/// grows lower is a single branch or a shoot on the stem.
const CROWN_GAP_SHARE: f64 = 0.15;
const CROWN_GAP_M: f64 = 1.0;

/// Reads the figures off a model and its points.
#[must_use]
pub fn metrics(
    model: &Model,
    points_m: &[[f64; 3]],
    owned: &Owned<'_>,
    base_m: [f64; 3],
    noise_m: Option<f64>,
    params: &Params,
) -> Metrics {
    let top = points_m.iter().map(|point| point[2]).fold(f64::NEG_INFINITY, f64::max);
    let height_m = if top.is_finite() { (top - base_m[2]).max(0.0) } else { 0.0 };
    let crown_base_m = crown_base(model, base_m[2], height_m);
    let crown_area_m2 = crown_area(points_m, base_m[2] + crown_base_m.unwrap_or(0.0));
    let mut found = Metrics {
        dbh: dbh(model, owned, base_m[2], noise_m, params),
        height_m,
        crown_base_m,
        crown_area_m2,
        crown_diameter_m: 2.0 * (crown_area_m2 / PI).sqrt(),
        taper: taper(model, base_m[2], params),
        ..Metrics::default()
    };
    for cylinder in &model.cylinders {
        let volume = cylinder.solid.volume_m3();
        found.surface_m2 += cylinder.solid.lateral_area_m2();
        found.length_m += cylinder.solid.length_m();
        if cylinder.branch == 0 {
            found.stem_volume_m3 += volume;
        } else if 2.0 * cylinder.solid.radius_m >= params.thick_m {
            found.thick_volume_m3 += volume;
        } else {
            found.thin_volume_m3 += volume;
        }
    }
    found
}

/// Branches, cylinders, length and volume by order of branching.
#[must_use]
pub fn order_table(model: &Model) -> Vec<OrderRow> {
    let orders = model.branches.iter().map(|branch| branch.order + 1).max().unwrap_or(0);
    let mut rows: Vec<OrderRow> =
        (0..orders).map(|order| OrderRow { order, ..OrderRow::default() }).collect();
    for branch in &model.branches {
        let row = &mut rows[branch.order as usize];
        row.branches += 1;
        row.cylinders += branch.len;
        for cylinder in model.cylinders_of(branch) {
            row.length_m += cylinder.solid.length_m();
            row.volume_m3 += cylinder.solid.volume_m3();
        }
    }
    rows
}

/// Height of the lowest branch on the stem from which others follow upwards without a long gap.
fn crown_base(model: &Model, base_z_m: f64, height_m: f64) -> Option<f64> {
    let least = CROWN_BRANCH_M.min(CROWN_BRANCH_SHARE * height_m);
    let length = |branch: &ModelBranch| -> f64 {
        model.cylinders_of(branch).iter().map(|cylinder| cylinder.solid.length_m()).sum()
    };
    let grown = |branch: &&ModelBranch| branch.order == 1 && length(branch) >= least;
    let begins = |branch: &ModelBranch| {
        let cylinder = model.cylinders_of(branch).first()?;
        Some(cylinder.solid.start_m[2] - base_z_m)
    };
    let mut heights: Vec<f64> = model.branches.iter().filter(grown).filter_map(begins).collect();
    heights.sort_unstable_by(|a, b| b.total_cmp(a));
    let gap = CROWN_GAP_M.max(CROWN_GAP_SHARE * height_m);
    let mut heights = heights.into_iter();
    let mut lowest = heights.next()?;
    for height in heights {
        if lowest - height > gap {
            break;
        }
        lowest = height;
    }
    Some(lowest.max(0.0))
}

fn crown_area(points_m: &[[f64; 3]], from_z_m: f64) -> f64 {
    let above = points_m.iter().filter(|point| point[2] >= from_z_m);
    hull_area_m2(above.map(|point| [point[0], point[1]]).collect())
}
