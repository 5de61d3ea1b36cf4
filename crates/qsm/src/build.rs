//! From a skeleton and points to a model.

use crate::assign::assign;
use crate::axis::{Joints, moved, rebuilt};
use crate::bound::Bound;
use crate::branches::{Branch, split};
use crate::measure::{Measured, Owned, measure, noise_of, noise_of_stem};
use crate::pipe::PipeModel;
use crate::points::Points;
use crate::prune::{begin, pruned};
use crate::radii::{Given, Radius, radii};
use crate::sections::{Sections, as_they_are, cut};
use crate::{Error, Method, Model, ModelBranch, ModelCylinder, Params, RadiusSource, SkeletonNode};
use timberline_solids::Cylinder;

/// Most points that the first pass looks at: it only has to find out how thick branches are.
const FIRST_PASS_POINTS: usize = 250_000;

/// A model with what was learnt on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The model.
    pub model: Model,
    /// The section, which is the cylinder, of every point.
    pub owner: Vec<u32>,
    /// What points scatter across surfaces, m; none where nothing was fitted.
    pub noise_m: Option<f64>,
    /// The tree's pipe model; none where nothing was fitted.
    pub pipe: Option<PipeModel>,
}

/// Builds the model of a tree.
///
/// # Errors
/// What is wrong with the skeleton.
pub fn build(
    points: &Points,
    skeleton: &[SkeletonNode],
    bound: Option<&Bound>,
    params: &Params,
) -> Result<Built, Error> {
    if params.method == Method::Adtree {
        return Ok(unfitted(points, &split(skeleton)?, params));
    }
    let branches = match bound {
        Some(bound) => split(&bound.kept(skeleton))?,
        None => split(skeleton)?,
    };
    Ok(fitted(points, branches, bound, params))
}

/// The skeleton's segments with its radii.
fn unfitted(points: &Points, branches: &[Branch], params: &Params) -> Built {
    let sections = as_they_are(branches, params);
    let owner = assign(&points.points_m, &sections.all);
    let radius = |section: &crate::sections::Section| Radius {
        radius_m: section.radius_m,
        sd_m: f64::NAN,
        source: RadiusSource::Inferred,
    };
    let radii: Vec<Radius> = sections.all.iter().map(radius).collect();
    let measured = vec![None; radii.len()];
    let joints: Vec<Joints> = (0..branches.len()).map(|number| as_is(&sections, number)).collect();
    let whole: Vec<Branch> =
        branches.iter().map(|branch| Branch { fork: None, ..branch.clone() }).collect();
    let (mut model, _) = model(&whole, &sections, &joints, &radii, &measured);
    for (number, branch) in branches.iter().enumerate() {
        let Some(fork) = branch.fork else { continue };
        let first = model.branches[number].first as usize;
        model.branches[number].parent = Some(fork.branch);
        model.cylinders[first].parent = Some(sections.at(fork.branch as usize, fork.at_m) as u32);
    }
    Built { model, owner, noise_m: None, pipe: None }
}

fn as_is(sections: &Sections, number: usize) -> Joints {
    let pieces = &sections.all[sections.of(number)];
    let first = pieces.first().map(|piece| piece.start_m);
    let at_m = first.into_iter().chain(pieces.iter().map(|piece| piece.end_m)).collect();
    Joints { at_m, fork: None, root_m: None }
}

/// What a pass finds.
struct Pass {
    sections: Sections,
    owner: Vec<u32>,
    measured: Vec<Option<Measured>>,
    radii: Vec<Radius>,
    joints: Vec<Joints>,
    noise_m: Option<f64>,
    pipe: Option<PipeModel>,
}

/// Cuts, assigns, fits, and finds radii and axes.
fn pass(
    points: &Points,
    branches: &[Branch],
    noise_m: Option<f64>,
    bound: Option<&Bound>,
    params: &Params,
) -> Pass {
    let sections = cut(branches, params);
    let owner = assign(&points.points_m, &sections.all);
    let owned = Owned::new(&points.points_m, points.wood.as_deref(), &owner, sections.all.len());
    let noise_m = noise_of_stem(&sections, &owned, params).or(noise_m);
    let measured = bounded(measure(&sections, &owned, noise_m, params), bound);
    let own_noise = noise_m.or_else(|| noise_of(&measured));
    let noise = own_noise.unwrap_or(params.noise_m);
    let given = Given { branches, sections: &sections, measured: &measured, noise_m: noise };
    let (radii, pipe) = radii(&given, params);
    let radii = limited(radii, &sections, bound);
    let joints = moved(branches, &sections, &measured, &radii, &owned, noise);
    Pass { sections, owner, measured, radii, joints, noise_m: own_noise, pipe }
}

/// Leaves out fits of what is too thick for the tree: foliage around an axis.
fn bounded(measured: Vec<Option<Measured>>, bound: Option<&Bound>) -> Vec<Option<Measured>> {
    let Some(bound) = bound else { return measured };
    let fits = |one: &Measured| one.fit.radius_m <= bound.at(one.view.origin_m[2]);
    measured.into_iter().map(|one| one.filter(fits)).collect()
}

/// Radii that no fit stands for keep to the bound, too: the pipe model of a tree with few fits may have
/// any.
fn limited(mut radii: Vec<Radius>, sections: &Sections, bound: Option<&Bound>) -> Vec<Radius> {
    let Some(bound) = bound else { return radii };
    for (radius, section) in radii.iter_mut().zip(&sections.all) {
        let middle_z_m = 0.5 * (section.start_m[2] + section.end_m[2]);
        radius.radius_m = radius.radius_m.min(bound.at(middle_z_m));
    }
    radii
}

/// Two passes: the first finds how thick branches are, whatever the skeleton says; the second fits
/// sections of the right length along the corrected axes.
fn fitted(points: &Points, branches: Vec<Branch>, bound: Option<&Bound>, params: &Params) -> Built {
    let thinned = points.thinned(FIRST_PASS_POINTS);
    let first = pass(&thinned, &branches, None, bound, params);
    let noise = first.noise_m.unwrap_or(params.noise_m);
    let branches = rebuilt(&branches, &first.joints, &first.sections, &first.radii);
    let mut branches = pruned(branches.clone(), &cut(&branches, params), noise);
    let sections = cut(&branches, params);
    begin(&mut branches, &sections, noise);
    let second = pass(points, &branches, first.noise_m, bound, params);
    let Pass { sections, owner, measured, radii, joints, noise_m, pipe } = second;
    let (model, cylinder_of) = model(&branches, &sections, &joints, &radii, &measured);
    let owner = owner.iter().map(|section| cylinder_of[*section as usize]).collect();
    Built { model, owner, noise_m, pipe }
}

/// Puts sections, axes and radii together. Second, the cylinder of every section: sections at the foot
/// of a branch whose axis is still inside the wood that it grows on become part of that.
fn model(
    branches: &[Branch],
    sections: &Sections,
    joints: &[Joints],
    radii: &[Radius],
    measured: &[Option<Measured>],
) -> (Model, Vec<u32>) {
    let mut model = Model::default();
    let mut cylinder_of = vec![0u32; sections.all.len()];
    for (number, branch) in branches.iter().enumerate() {
        let range = sections.of(number);
        let at_m = &joints[number].at_m;
        let fork = branch.fork.map(|fork| sections.at(fork.branch as usize, fork.at_m));
        let mut parent = fork.map(|section| cylinder_of[section]);
        let (inside, on) = match branch.fork {
            Some(fork) => buried(&model, &model.branches[fork.branch as usize], at_m, parent),
            None => (0, parent),
        };
        parent = on;
        cylinder_of[range.clone()][..inside].fill(parent.unwrap_or(0));
        let first = model.cylinders.len();
        for (ends, place) in at_m.windows(2).zip(range.clone()).skip(inside) {
            let next = model.cylinders.len() as u32;
            let solid =
                Cylinder { start_m: ends[0], end_m: ends[1], radius_m: radii[place].radius_m };
            let fit = measured[place].filter(|_| radii[place].source == RadiusSource::Measured);
            model.cylinders.push(cylinder(solid, &radii[place], fit.as_ref(), parent, number));
            cylinder_of[place] = next;
            parent = Some(next);
        }
        model.branches.push(ModelBranch {
            parent: branch.fork.map(|fork| fork.branch),
            order: branch.order,
            first: first as u32,
            len: (model.cylinders.len() - first) as u32,
        });
    }
    (model, cylinder_of)
}

fn cylinder(
    solid: Cylinder,
    radius: &Radius,
    measured: Option<&Measured>,
    parent: Option<u32>,
    branch: usize,
) -> ModelCylinder {
    ModelCylinder {
        solid,
        radius_sd_m: radius.sd_m,
        source: radius.source,
        arc_coverage: measured.map_or(0.0, |measured| measured.fit.arc_coverage),
        points: measured.map_or(0, |measured| measured.fit.points),
        parent,
        branch: branch as u32,
    }
}

/// Number of sections at the foot of a branch that end inside the wood of the branch it grows on, and
/// the cylinder of that which the first of the others grows on. One section is always left.
fn buried(
    model: &Model,
    other: &ModelBranch,
    at_m: &[[f64; 3]],
    parent: Option<u32>,
) -> (usize, Option<u32>) {
    let (mut inside, mut on) = (0, parent);
    for end in &at_m[1..at_m.len() - 1] {
        let all = (other.first..).zip(model.cylinders_of(other));
        let holds =
            |(_, cylinder): &(u32, &ModelCylinder)| cylinder.solid.signed_distance_m(*end) <= 0.0;
        let Some((place, _)) = all.into_iter().find(holds) else { break };
        inside += 1;
        on = Some(place);
    }
    (inside, on)
}
