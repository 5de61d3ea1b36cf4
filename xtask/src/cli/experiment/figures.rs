//! The experiment's figures: rows of the tables as curves.

use timberline_experiment::crowns::plan::OMEGA_WITH_PRIOR;
use timberline_experiment::crowns::{Assessed, Bounds, Family, Row, Setting};
use timberline_report::chart::{Axis, Chart, Curve, Level, Marker, Panel, Stroke};
use timberline_report::colour::Rgb;

// Okabe and Ito 2008: told apart with any colour vision.
const BLUE: Rgb = [0, 114, 178];
const SKY: Rgb = [86, 180, 233];
const VERMILION: Rgb = [213, 94, 0];
const ORANGE: Rgb = [230, 159, 0];
const GREEN: Rgb = [0, 158, 115];
const PURPLE: Rgb = [204, 121, 167];
const GREY: Rgb = [120, 120, 120];

/// Where "no prior" stands on the axis of delta, m.
const NO_PRIOR: f64 = 1.2;

/// Panels in the layout of the paper's Figure 4: a row for every dataset, on the left the median
/// error over omega without a prior, on the right over the half width of the prior's box.
pub(super) fn figure4(all: &[Assessed], cell_m: f64) -> Chart {
    let panels = all.iter().flat_map(|one| {
        let most = most(one, cell_m);
        [omega(one, cell_m, most), delta(one, cell_m, most)]
    });
    Chart {
        title: "Distance of tree positions from the stem".to_owned(),
        panels: panels.collect(),
        columns: 2,
        panel_px: [1080, 760],
        note: format!(
            "Medians over all trees; crowns thinned to the highest point of cells of {cell_m} m; prior at the highest point."
        ),
    }
}

/// The end of the axis of errors, m.
fn most(one: &Assessed, cell_m: f64) -> f64 {
    let rows = one.rows.iter().filter(|row| row.cell_m == cell_m);
    let highest = rows.map(|row| row.median_m).fold(0.1, f64::max);
    (highest * 1.08 / 0.1).ceil() * 0.1
}

fn omega(one: &Assessed, cell_m: f64, most: f64) -> Panel {
    let curve = |name: &str, colour: Rgb, bounds: Bounds| {
        let place = |row: &Row| [row.setting.omega.unwrap_or(0.0), row.median_m];
        let rows = one.over_omega(bounds, cell_m);
        Curve::new(name, colour, rows.into_iter().map(place).collect())
    };
    Panel {
        title: format!("Dataset {}: no prior", one.facts.dataset),
        x: Axis::new("Largest imbalance of the axes, ω", [0.0, 1.0]),
        y: error_axis(most),
        curves: vec![
            curve("L1, μ of the paper", BLUE, Bounds::Paper),
            curve("L1, exact axis bounds", SKY, Bounds::Exact).drawn(Stroke::Dashed, Marker::Ring),
        ],
        levels: baselines(one, cell_m),
    }
}

fn delta(one: &Assessed, cell_m: f64, most: f64) -> Panel {
    let curve = |name: &str, colour: Rgb, free: Setting| {
        let with = one.over_delta(free, cell_m).into_iter();
        let mut places: Vec<[f64; 2]> =
            with.map(|row| [row.setting.delta_m.unwrap_or(0.0), row.median_m]).collect();
        places.extend(one.row(&free, cell_m).map(|row| [NO_PRIOR, row.median_m]));
        Curve::new(name, colour, places)
    };
    let second = format!("L1 with prior, ω = {OMEGA_WITH_PRIOR}");
    Panel {
        title: format!("Dataset {}: prior at the highest point", one.facts.dataset),
        x: Axis {
            names: vec![(NO_PRIOR, "none".to_owned())],
            ..Axis::new("Half width of the prior's box, δ [m]", [0.0, NO_PRIOR])
        },
        y: error_axis(most),
        curves: vec![
            curve("L1 with prior, ω = 0", VERMILION, Setting::l1(0.0, Bounds::Paper)),
            curve(&second, ORANGE, Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact))
                .drawn(Stroke::Dashed, Marker::Ring),
        ],
        levels: baselines(one, cell_m),
    }
}

fn error_axis(most: f64) -> Axis {
    Axis::new("Median error [m]", [0.0, most])
}

fn baselines(one: &Assessed, cell_m: f64) -> Vec<Level> {
    let baselines = [
        (Family::HullCentroid, "hull centroid", GREY),
        (Family::L2Equal, "L2, equal axes", PURPLE),
        (Family::L2Free, "L2, free axes", [120, 60, 110]),
        (Family::HighestPoint, "highest point", GREEN),
    ];
    let level = |(family, name, colour): (Family, &str, Rgb)| {
        let row = one.row(&Setting::plain(family), cell_m)?;
        Some(Level::new(name, colour, row.median_m))
    };
    baselines.into_iter().filter_map(level).collect()
}
