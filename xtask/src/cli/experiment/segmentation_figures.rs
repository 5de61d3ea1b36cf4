//! Figures of the comparison of segmenters: F over density and by canopy layer.

use timberline_experiment::segmentation::{Experiment, Pooled, StandKind};
use timberline_report::chart::{Axis, Chart, Curve, Marker, Panel, Stroke};
use timberline_report::colour::Rgb;

/// Okabe and Ito 2008: told apart with any colour vision.
const COLOURS: [Rgb; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [120, 120, 120],
];

/// The density of the figure by layer, points per square metre.
const USUAL_DENSITY_PER_M2: f64 = 10.0;

/// F of all trees over the density of points: a panel for every kind of stand, a curve for every
/// set of trees.
pub(super) fn density(experiment: &Experiment, trees: &[Pooled]) -> Chart {
    let note = "All true trees from 2 m of height on, seen from above or not.";
    over_density(experiment, trees, "Trees found, F", note, |one| one.summary.all.f_score())
}

/// F of segments over the density of points: a panel for every kind of stand, a curve for every
/// segmenter.
pub(super) fn segments(experiment: &Experiment, pooled: &[Pooled]) -> Chart {
    let note =
        "Trees of which a segment holds half: intersection over union of the points from 0.5 on.";
    let title = "Trees held by segments, F";
    over_density(experiment, pooled, title, note, |one| one.summary.segments.f_score())
}

fn over_density(
    experiment: &Experiment,
    pooled: &[Pooled],
    title: &str,
    note: &str,
    value: impl Fn(&Pooled) -> Option<f64>,
) -> Chart {
    let mut densities = experiment.densities_per_m2.clone();
    densities.sort_by(f64::total_cmp);
    let x = Axis::places("Density [points per m²]", densities.iter().map(f64::to_string));
    let place = |one: &Pooled| {
        let at = densities.iter().position(|density| *density == one.case.density_per_m2)?;
        Some([at as f64, value(one)?])
    };
    let panel = |&stand: &StandKind| {
        let own: Vec<&Pooled> = pooled.iter().filter(|one| one.case.stand == stand).collect();
        Panel {
            title: stand.name().to_owned(),
            x: x.clone(),
            y: f_axis(),
            curves: curves(pooled, &own, place),
            levels: Vec::new(),
        }
    };
    Chart {
        title: title.to_owned(),
        panels: experiment.stands.iter().map(panel).collect(),
        columns: 3,
        panel_px: [720, 620],
        note: note.to_owned(),
    }
}

/// F by canopy layer at one density.
pub(super) fn layers(experiment: &Experiment, pooled: &[Pooled]) -> Chart {
    let at = usual(&experiment.densities_per_m2);
    let x = Axis::places("Canopy layer", ["upper", "middle", "lower"].map(str::to_owned));
    let panel = |&stand: &StandKind| {
        let own = |one: &&Pooled| one.case.stand == stand && one.case.density_per_m2 == at;
        let own: Vec<&Pooled> = pooled.iter().filter(own).collect();
        Panel {
            title: stand.name().to_owned(),
            x: x.clone(),
            y: f_axis(),
            curves: layer_curves(pooled, &own),
            levels: Vec::new(),
        }
    };
    Chart {
        title: format!("Trees found by canopy layer, F at {at} points per m²"),
        panels: experiment.stands.iter().map(panel).collect(),
        columns: 3,
        panel_px: [720, 620],
        note:
            "A layer is a third of the top height around. Layers without true trees are left out."
                .to_owned(),
    }
}

fn usual(densities: &[f64]) -> f64 {
    let off = |density: f64| libm::log(density / USUAL_DENSITY_PER_M2).abs();
    let nearest = densities.iter().copied().min_by(|a, b| off(*a).total_cmp(&off(*b)));
    nearest.unwrap_or(USUAL_DENSITY_PER_M2)
}

fn f_axis() -> Axis {
    Axis::new("F", [0.0, 1.0])
}

/// Names of the segmenters in the sequence of the outcomes.
fn methods(pooled: &[Pooled]) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for one in pooled {
        if !names.contains(&one.method) {
            names.push(one.method);
        }
    }
    names
}

fn curves(
    pooled: &[Pooled],
    own: &[&Pooled],
    place: impl Fn(&Pooled) -> Option<[f64; 2]>,
) -> Vec<Curve> {
    let curve = |(index, name): (usize, &'static str)| {
        let of = own.iter().filter(|one| one.method == name);
        let mut places: Vec<[f64; 2]> = of.filter_map(|one| place(one)).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]));
        styled(index, name, places)
    };
    methods(pooled).into_iter().enumerate().map(curve).collect()
}

fn layer_curves(pooled: &[Pooled], own: &[&Pooled]) -> Vec<Curve> {
    let curve = |(index, name): (usize, &'static str)| {
        let one = own.iter().find(|one| one.method == name);
        let layers = one.map(|one| one.summary.by_layer.iter().enumerate());
        let known = layers.into_iter().flatten().filter(|(_, layer)| layer.reference > 0);
        let places = known.map(|(i, layer)| [i as f64, layer.f_score().unwrap_or(0.0)]).collect();
        styled(index, name, places)
    };
    methods(pooled).into_iter().enumerate().map(curve).collect()
}

/// Curves that coincide stay visible: the later ones are dashed, with rings.
fn styled(index: usize, name: &str, places: Vec<[f64; 2]>) -> Curve {
    let curve = Curve::new(name, COLOURS[index % COLOURS.len()], places);
    if index % 2 == 1 { curve.drawn(Stroke::Dashed, Marker::Ring) } else { curve }
}
