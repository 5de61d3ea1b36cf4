//! A tree's position by the method of the parameters, as fields of its row.

use crate::Error;
use crate::params::{BoundsRule, CrownFitParams, FitMethod, PriorRule, SolverChoice};
use crate::surface::{
    self, Axes, AxisBounds, Engine, Fit, Flag, HighestPoint, HullCentroid, L1, L2, Method, Prior,
    Problem, StarSac, Surface, Uncertainty,
};
use timberline_artefact::Surroundings;
use timberline_artefact::kinds::{Labels, PositionMethod, Tree, TreeFlag};
use timberline_pointcloud::frame::quantise;

/// Semi-axes that differ by a smaller share have no direction: what is left of rounding.
const EQUAL_AXES: f64 = 1e-9;

/// What there is to say about a tree besides its row.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Placed {
    /// What is remarkable.
    pub(super) flags: Vec<TreeFlag>,
    /// What did not work.
    pub(super) warning: Option<String>,
}

/// Puts a tree, which is at its highest point so far, where the method says, and describes the
/// surface. Whatever is wrong with a tree's points concerns that tree alone.
pub(super) fn place(
    tree: &mut Tree,
    points: &[u32],
    near: &Surroundings,
    params: &CrownFitParams,
) -> Placed {
    if params.method == FitMethod::HighestPoint {
        return Placed::default();
    }
    match solve(tree.apex_m, points, near, params) {
        Ok(solved) => describe(tree, &solved, params.method),
        Err(error) => {
            let nothing = matches!(error, Error::NoCells);
            let flag = if nothing { TreeFlag::Underdetermined } else { TreeFlag::FitFailed };
            Placed { flags: vec![flag], warning: Some(unfitted(error)) }
        }
    }
}

fn unfitted(reason: impl std::fmt::Display) -> String {
    format!("no crown fit, highest point kept: {reason}")
}

/// What a method found, relative to the tree's highest point.
struct Solved {
    cells: Vec<[f64; 3]>,
    fit: Fit,
    uncertainty: Result<Option<Uncertainty>, Error>,
}

fn solve(
    apex_m: [f64; 3],
    points: &[u32],
    near: &Surroundings,
    params: &CrownFitParams,
) -> Result<Solved, Error> {
    let on_surface = points.iter().filter(|&&i| near.score[i as usize] > Labels::ON_SURFACE);
    let world = on_surface.map(|&i| near.cloud.world(i as usize));
    let cells = match params.method {
        FitMethod::L1 | FitMethod::L2 => surface::thin(world, apex_m, params.cell_m)?,
        _ => world.map(|point| [0, 1, 2].map(|axis| point[axis] - apex_m[axis])).collect(),
    };
    let problem = Problem { prior: prior(params), ..Problem::new(&cells) };
    let fit = fit(params, &problem)?;
    let sought = params.uncertainty && params.method == FitMethod::L1;
    let uncertainty = if sought { l1(params).uncertainty(&problem, &fit) } else { Ok(None) };
    Ok(Solved { fit, uncertainty, cells })
}

fn fit(params: &CrownFitParams, problem: &Problem<'_>) -> Result<Fit, Error> {
    let axes = if params.omega > 0.0 { Axes::Free } else { Axes::Equal };
    match params.method {
        FitMethod::L1 => l1(params).fit(problem),
        FitMethod::L2 => L2 { axes }.fit(problem),
        FitMethod::HullCentroid => HullCentroid.fit(problem),
        FitMethod::HighestPoint => HighestPoint.fit(problem),
        FitMethod::StarSac => StarSac::default().fit(problem),
    }
}

fn l1(params: &CrownFitParams) -> L1 {
    let (smallest_m, largest_m) = (params.smallest_axis_m, params.largest_axis_m);
    L1 {
        omega: params.omega,
        bounds: match params.bounds {
            BoundsRule::Exact => AxisBounds::Exact { smallest_m, largest_m },
            BoundsRule::Paper => AxisBounds::Paper { largest_m },
        },
        engine: match params.solver {
            SolverChoice::Dedicated => Engine::Dedicated,
            SolverChoice::Clarabel => Engine::Clarabel,
        },
    }
}

/// The box around the highest point, which is the origin.
fn prior(params: &CrownFitParams) -> Option<Prior> {
    match params.prior {
        PriorRule::HighestPoint => {
            Some(Prior { centre: [0.0; 2], half_width_m: params.prior_half_width_m })
        }
        PriorRule::None => None,
    }
}

/// Fills in what was found.
fn describe(tree: &mut Tree, solved: &Solved, method: FitMethod) -> Placed {
    let Solved { fit, cells, uncertainty } = solved;
    let flags = fit.flags.iter().map(|flag| wire_flag(*flag)).collect();
    let lacks = |flag: Flag| !fit.flags.contains(&flag);
    if let Some(surface) = &fit.surface {
        add_surface(tree, surface, cells);
    }
    if let (FitMethod::L1, Some(certificate)) = (method, &fit.certificate) {
        tree.fit_gap = certificate.relative_gap();
        tree.fit_nodes = certificate.nodes;
    }
    let mut warning = None;
    match uncertainty {
        Ok(None) => {}
        Ok(Some(found)) => {
            tree.position_extent_m = found.extent_m;
            tree.position_standard_error_m = found.standard_error_m;
        }
        Err(error) => warning = Some(format!("uncertainty of the crown fit unknown: {error}")),
    }
    if !lacks(Flag::Underdetermined) || !lacks(Flag::NotElliptic) {
        warning = Some(unfitted(reason(cells.len(), lacks(Flag::NotElliptic))));
    } else if lacks(Flag::CentreOutsideData) {
        tree.position_method = wire_method(method);
        tree.position_m = [0, 1].map(|axis| quantise(tree.apex_m[axis] + fit.position[axis]));
    }
    Placed { flags, warning }
}

fn reason(cells: usize, undetermined: bool) -> String {
    if undetermined {
        format!("{cells} cells do not determine a surface")
    } else {
        format!("the surface through {cells} cells is no elliptic paraboloid opening downward")
    }
}

fn add_surface(tree: &mut Tree, surface: &Surface, cells: &[[f64; 3]]) {
    let total: f64 = cells.iter().map(|&[x, y, z]| (surface.z(x, y) - z).abs()).sum();
    tree.fit_cells = cells.len() as u32;
    tree.fit_objective_m = total;
    tree.fit_residual_m = total / cells.len() as f64;
    let (centre, apex_z_m) = match surface {
        Surface::Paraboloid(paraboloid) => {
            let Some(shape) = paraboloid.shape() else { return };
            tree.semi_axes_m = shape.semiaxes_m;
            tree.rotation_deg = rotation_deg(shape.semiaxes_m, shape.azimuth);
            (shape.centre, shape.apex_z_m)
        }
        Surface::Revolved { centre, apex_z_m, model } => {
            // Where b1 r + b2 r² is one metre.
            let radius = 2.0 / (model.b1 + (model.b1 * model.b1 + 4.0 * model.b2).sqrt());
            tree.semi_axes_m = [radius; 2];
            (*centre, *apex_z_m)
        }
    };
    tree.surface_centre_m = [0, 1].map(|axis| quantise(tree.apex_m[axis] + centre[axis]));
    tree.surface_apex_m = quantise(tree.apex_m[2] + apex_z_m);
}

/// Degrees clockwise from north, 0 to below 180, of a direction in radians counter-clockwise from
/// east; NaN where the axes are equal.
fn rotation_deg([larger, smaller]: [f64; 2], direction: f64) -> f64 {
    if larger - smaller <= EQUAL_AXES * larger {
        return f64::NAN;
    }
    let azimuth = (90.0 - direction.to_degrees()).rem_euclid(180.0);
    // A tiny negative angle rounds to a half turn.
    if azimuth < 180.0 { azimuth } else { 0.0 }
}

fn wire_method(method: FitMethod) -> PositionMethod {
    match method {
        FitMethod::L1 => PositionMethod::L1,
        FitMethod::L2 => PositionMethod::L2,
        FitMethod::HullCentroid => PositionMethod::HullCentroid,
        FitMethod::HighestPoint => PositionMethod::HighestPoint,
        FitMethod::StarSac => PositionMethod::StarSac,
    }
}

fn wire_flag(flag: Flag) -> TreeFlag {
    match flag {
        Flag::Underdetermined => TreeFlag::Underdetermined,
        Flag::NoRedundancy => TreeFlag::NoRedundancy,
        Flag::ShapeBoundActive => TreeFlag::ShapeBoundActive,
        Flag::ImbalanceActive => TreeFlag::ImbalanceActive,
        Flag::PriorActive => TreeFlag::PriorActive,
        Flag::CentreOutsideData => TreeFlag::CentreOutsideData,
        Flag::OneSided => TreeFlag::OneSided,
        Flag::NotElliptic => TreeFlag::NotElliptic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::starsac;
    use crate::surface::{Paraboloid, Shape};

    #[test]
    fn directions_are_told_clockwise_from_north() {
        let turned = |degrees: f64| rotation_deg([2.0, 1.0], degrees.to_radians());
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(near(turned(0.0), 90.0) && near(turned(30.0), 60.0) && near(turned(120.0), 150.0));
        assert!(turned(90.0).abs() < 1e-9 && turned(90.0 + 1e-15) < 180.0);
        assert!(rotation_deg([1.5, 1.5], 0.0).is_nan());
    }

    #[test]
    fn a_surface_is_described_in_the_world() {
        let shape = Shape {
            centre: [0.25, -0.5],
            apex_z_m: 0.5,
            semiaxes_m: [2.0, 1.0],
            azimuth: std::f64::consts::FRAC_PI_6,
        };
        let surface = Paraboloid::from_shape(&shape);
        let cells = [[0.0, 0.0, surface.z(0.0, 0.0) + 0.5], [1.0, 0.0, surface.z(1.0, 0.0) - 0.25]];
        let mut tree = Tree { apex_m: [1000.0, 2000.0, 30.0], ..Tree::without_fit() };
        add_surface(&mut tree, &Surface::Paraboloid(surface), &cells);
        assert_eq!(tree.surface_centre_m, [1000.25, 1999.5]);
        assert_eq!((tree.surface_apex_m, tree.fit_cells), (30.5, 2));
        assert!(
            (tree.semi_axes_m[0] - 2.0).abs() < 1e-9 && (tree.rotation_deg - 60.0).abs() < 1e-6
        );
        assert!(
            (tree.fit_objective_m - 0.75).abs() < 1e-9
                && (tree.fit_residual_m - 0.375).abs() < 1e-9
        );
    }

    #[test]
    fn a_model_of_revolution_has_equal_semi_axes_and_no_rotation() {
        let model = starsac::Model { shape: starsac::Shape::TwoParameter, b1: 0.5, b2: 0.5 };
        let surface = Surface::Revolved { centre: [0.0; 2], apex_z_m: 0.0, model };
        let mut tree = Tree::without_fit();
        add_surface(&mut tree, &surface, &[[1.0, 0.0, -1.0]]);
        assert_eq!((tree.semi_axes_m, tree.fit_residual_m), ([1.0; 2], 0.0));
        assert!(tree.rotation_deg.is_nan());
    }

    #[test]
    fn a_surface_without_an_apex_has_a_residual_only() {
        let saddle = Paraboloid { phi: [-1.0, 1.0, 0.0, 0.0, 0.0, 0.0] };
        let mut tree = Tree::without_fit();
        add_surface(&mut tree, &Surface::Paraboloid(saddle), &[[1.0, 0.0, 0.0]]);
        assert_eq!(tree.fit_residual_m, 1.0);
        assert!(tree.semi_axes_m[0].is_nan() && tree.surface_centre_m[0].is_nan());
    }
}
