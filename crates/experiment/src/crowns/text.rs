//! Tables of an experiment as text: CSV for programs, Markdown for people.

use super::assess::{Assessed, best};
use super::compare::Row;
use super::paper::{DIFFERENCES, Paper};
use super::plan::{Bounds, Family, OMEGA_WITH_PRIOR, Setting, deltas_m, omegas};
use std::fmt::Write as _;
use timberline_crowns::surface::Flag;

/// One line for every dataset, method, parameters and cell size; lengths in metres.
#[must_use]
pub fn methods_csv(all: &[Assessed]) -> String {
    let mut text = String::from(
        "dataset,method,omega,bounds,prior_delta_m,cell_m,trees,median_m,median_smallest_m,\
         median_largest_m,mean_m,rmse_m,quartile1_m,quartile3_m,p95_m,surfaces,failures,\
         largest_gap,mean_nodes,most_nodes",
    );
    for flag in Flag::ALL {
        text += &format!(",{}", flag.name().replace('-', "_"));
    }
    text.push('\n');
    for row in all.iter().flat_map(|one| &one.rows) {
        let lengths = [row.median_m, row.median_range_m[0], row.median_range_m[1], row.mean_m];
        let more = [row.rmse_m, row.quartiles_m[0], row.quartiles_m[1], row.p95_m];
        let mut cells = setting_cells(&row.dataset, &row.setting, row.cell_m);
        cells.push(row.trees.to_string());
        cells.extend(lengths.iter().chain(&more).map(|length| format!("{length:.4}")));
        cells.extend([row.surfaces.to_string(), row.failures.to_string()]);
        cells.push(row.largest_gap.map(|gap| format!("{gap:.1e}")).unwrap_or_default());
        cells.push(row.mean_nodes.map(|nodes| format!("{nodes:.2}")).unwrap_or_default());
        cells.push(row.most_nodes.map(|nodes| nodes.to_string()).unwrap_or_default());
        let flags = Flag::ALL.map(|flag| row.flags.get(flag.name()).copied().unwrap_or(0));
        cells.extend(flags.map(|count| count.to_string()));
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

/// One line for every tree, method, parameters and cell size; lengths in metres.
#[must_use]
pub fn trees_csv(all: &[Assessed]) -> String {
    let mut text = String::from(
        "dataset,method,omega,bounds,prior_delta_m,cell_m,repeat,tree,height_m,points,segment,\
         error_m,offset_x_m,offset_y_m,surface,flags,objective_m,relative_gap,nodes\n",
    );
    for one in all {
        let clusters = one.clusters.iter().map(|cluster| {
            let height = if cluster.height_m.is_nan() {
                String::new()
            } else {
                format!("{:.2}", cluster.height_m)
            };
            let (points, faults) = (cluster.points.len(), cluster.faults.join(" "));
            format!("{},{},{height},{points},{faults}", cluster.repeat, cluster.id)
        });
        let clusters: Vec<String> = clusters.collect();
        for comparison in &one.comparisons {
            let setting =
                setting_cells(&one.facts.dataset, &comparison.setting, comparison.cell_m).join(",");
            for (cluster, outcome) in clusters.iter().zip(&comparison.outcomes) {
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{setting},{cluster},{}", outcome_cells(outcome));
            }
        }
    }
    text
}

/// One line for every tree: where it stands and what its points are like; lengths in metres.
#[must_use]
pub fn clusters_csv(all: &[Assessed]) -> String {
    let mut text = String::from(
        "dataset,repeat,tree,stem_x_m,stem_y_m,height_m,points,enclosing_radius_m,hull_m2,\
         points_per_m2,segment\n",
    );
    for one in all {
        let dataset = one.facts.dataset.replace([',', '\n', '"'], " ");
        for cluster in &one.clusters {
            let ([x, y], extent) = (cluster.reference, cluster.extent());
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{dataset},{},{},{x:.3},{y:.3},{:.2},{},{:.3},{:.2},{:.2},{}",
                cluster.repeat,
                cluster.id,
                cluster.height_m,
                cluster.points.len(),
                extent.enclosing_radius_m,
                extent.hull_m2,
                extent.density_per_m2,
                cluster.faults.join(" ")
            );
        }
    }
    text
}

fn setting_cells(dataset: &str, setting: &Setting, cell_m: f64) -> Vec<String> {
    let number = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    vec![
        dataset.replace([',', '\n', '"'], " "),
        setting.family.name().replace(',', ""),
        number(setting.omega),
        setting.bounds.map(|bounds| bounds.name().to_owned()).unwrap_or_default(),
        number(setting.delta_m),
        cell_m.to_string(),
    ]
}

fn outcome_cells(outcome: &super::compare::Outcome) -> String {
    let [dx, dy] = outcome.offset_m;
    let flags: Vec<&str> = outcome.flags.iter().map(|flag| flag.name()).collect();
    let fit = outcome.certificate.as_ref().map_or(",,".to_owned(), |certificate| {
        let gap = certificate.relative_gap();
        format!("{:.5},{gap:.1e},{}", certificate.objective_m, certificate.nodes)
    });
    let surface = u8::from(outcome.has_surface);
    format!("{:.4},{dx:.4},{dy:.4},{surface},{},{fit}", outcome.error_m(), flags.join(" "))
}

/// A Markdown table under construction.
struct Table(String);

impl Table {
    fn new(heading: &[String]) -> Self {
        let mut table = Self(String::new());
        table.row(heading);
        let rule: Vec<String> =
            (0..heading.len()).map(|i| if i == 0 { "---" } else { "---:" }.to_owned()).collect();
        table.row(&rule);
        table
    }

    fn row(&mut self, cells: &[String]) {
        self.0 += &format!("| {} |\n", cells.join(" | "));
    }
}

/// The whole report: data, methods beside the paper, sweeps, what the fits were like.
#[must_use]
pub fn markdown(all: &[Assessed], cells_m: &[f64]) -> String {
    let mut text = String::from(
        "# Positions of trees from their crowns\n\n\
         Median distance in the plane between a tree's position and the foot of its stem, in metres, after \
         Polewski et al., L1-norm fitting of elliptic paraboloids with prior information for enhanced \
         coniferous tree localization in ALS point clouds, section 6. In brackets the smallest and the \
         largest median of a repetition.\n",
    );
    let generated = all.iter().any(|one| Paper::of(&one.facts.dataset).is_some());
    text += &format!("\n## Data\n\n{}", data(all));
    text += &format!("\n## Methods\n\n{}", methods(all, cells_m));
    let Some(&cell_m) = cells_m.last() else { return text };
    text += &format!("\n## Fits (cells of {cell_m} m)\n\n{}", fits(all, cell_m));
    text +=
        &format!("\n## Over ω, without a prior (cells of {cell_m} m)\n\n{}", omega(all, cell_m));
    text += &format!(
        "\n## Over the prior's half width δ (cells of {cell_m} m)\n\n{}",
        delta(all, cell_m)
    );
    if generated {
        text += "\n## How the generated data differ from the paper's\n\n";
        DIFFERENCES.iter().for_each(|sentence| text += &format!("* {sentence}\n"));
    }
    text
}

fn data(all: &[Assessed]) -> String {
    let mut heading = vec!["dataset".to_owned()];
    heading.extend(
        [
            "trees",
            "repetitions",
            "mean height [m]",
            "enclosing radius [m]",
            "points/m² in crowns",
            "points of a tree",
            "segments with a fault",
        ]
        .map(str::to_owned),
    );
    let mut table = Table::new(&heading);
    for Assessed { facts, .. } in all {
        if let Some(paper) = Paper::of(&facts.dataset) {
            let trees = paper.trees.map_or("–".to_owned(), |trees| trees.to_string());
            let mut row = vec![format!("{}, paper ({})", paper.dataset, paper.species), trees];
            row.push("1".to_owned());
            row.extend(
                [paper.height_m, paper.enclosing_radius_m, paper.density_per_m2]
                    .map(|value| value.to_string()),
            );
            row.extend(["–".to_owned(), "–".to_owned()]);
            table.row(&row);
        }
        let faults: Vec<String> =
            facts.faults.iter().map(|(fault, count)| format!("{count} {fault}")).collect();
        let mut row = vec![format!("{}, here", facts.dataset), facts.trees.to_string()];
        row.push(facts.repeats.to_string());
        row.extend(
            [facts.height_m, facts.enclosing_radius_m, facts.density_per_m2]
                .map(|value| format!("{value:.2}")),
        );
        row.push(format!("{:.0}", facts.points));
        row.push(if faults.is_empty() { "none".to_owned() } else { faults.join(", ") });
        table.row(&row);
    }
    table.0
}

/// What the paper says of a method.
type OfPaper = fn(&Paper) -> &'static str;

/// The settings of the paper's comparison, with what it calls them.
fn compared() -> Vec<(String, OfPaper, Pick)> {
    let plain = |family: Family| Pick::Of(Setting::plain(family));
    let equal = Setting::l1(0.0, Bounds::Paper);
    let free = Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact);
    let none: OfPaper = |_| "–";
    vec![
        ("hull centroid".into(), |paper| paper.hull_m, plain(Family::HullCentroid)),
        ("highest point".into(), |paper| paper.highest_m, plain(Family::HighestPoint)),
        ("StarSac (highest cell)".into(), none, plain(Family::StarSac)),
        ("L2, equal axes".into(), |paper| paper.l2_m, plain(Family::L2Equal)),
        ("L2, free axes".into(), |paper| paper.l2_m, plain(Family::L2Free)),
        ("L1, ω = 0".into(), none, Pick::Of(equal)),
        ("L1, best ω".into(), |paper| paper.l1_m, Pick::BestOmega(Bounds::Paper)),
        ("L1, best ω, exact axis bounds".into(), none, Pick::BestOmega(Bounds::Exact)),
        (
            "L1, ω = 0, prior δ = 0.1 m".into(),
            |paper| paper.l1_prior_m,
            Pick::Of(equal.with_prior(0.1)),
        ),
        ("L1, ω = 0, prior, best δ".into(), none, Pick::BestDelta(equal)),
        (
            format!("L1, ω = {OMEGA_WITH_PRIOR}, prior δ = 0.1 m"),
            none,
            Pick::Of(free.with_prior(0.1)),
        ),
        (format!("L1, ω = {OMEGA_WITH_PRIOR}, prior, best δ"), none, Pick::BestDelta(free)),
    ]
}

/// Which row stands for a method.
enum Pick {
    Of(Setting),
    BestOmega(Bounds),
    BestDelta(Setting),
}

impl Pick {
    /// The cell of a dataset in the comparison.
    fn cell(&self, one: &Assessed, cell_m: f64) -> String {
        let found = match self {
            Self::Of(setting) => one.row(setting, cell_m),
            Self::BestOmega(bounds) => best(&one.over_omega(*bounds, cell_m)),
            Self::BestDelta(setting) => best(&one.over_delta(*setting, cell_m)),
        };
        let Some(row) = found else { return "–".to_owned() };
        let at = match self {
            Self::Of(_) => String::new(),
            Self::BestOmega(_) => format!(" at ω = {}", row.setting.omega.unwrap_or(0.0)),
            Self::BestDelta(_) => format!(" at δ = {} m", row.setting.delta_m.unwrap_or(0.0)),
        };
        format!("{}{at}", with_range(row))
    }
}

fn with_range(row: &Row) -> String {
    let [low, high] = row.median_range_m;
    let range = if high > low { format!(" ({low:.3} to {high:.3})") } else { String::new() };
    format!("{:.3}{range}", row.median_m)
}

fn methods(all: &[Assessed], cells_m: &[f64]) -> String {
    let mut heading = vec!["method".to_owned()];
    for one in all {
        let name = &one.facts.dataset;
        heading.extend(Paper::of(name).map(|_| format!("{name}, paper")));
        heading.extend(cells_m.iter().map(|cell| format!("{name}, cells {cell} m")));
    }
    let mut table = Table::new(&heading);
    for (name, of_paper, pick) in compared() {
        let mut row = vec![name];
        for one in all {
            row.extend(Paper::of(&one.facts.dataset).map(|paper| of_paper(paper).to_owned()));
            row.extend(cells_m.iter().map(|cell_m| pick.cell(one, *cell_m)));
        }
        table.row(&row);
    }
    table.0
}

/// What the fits were like: how many there are, of which kind, and how surely they are optimal.
fn fits(all: &[Assessed], cell_m: f64) -> String {
    let heading = [
        "dataset, method",
        "trees",
        "surfaces",
        "no elliptic paraboloid",
        "centre outside the data",
        "axis bound active",
        "prior active",
        "largest relative gap",
        "programs per tree (most)",
        "gave up",
    ];
    let mut table = Table::new(&heading.map(str::to_owned));
    let equal = Setting::l1(0.0, Bounds::Paper);
    let free = Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact);
    let shown = [
        Setting::plain(Family::StarSac),
        Setting::plain(Family::L2Equal),
        Setting::plain(Family::L2Free),
        equal,
        free,
        equal.with_prior(0.1),
        free.with_prior(0.1),
    ];
    for one in all {
        for row in shown.iter().filter_map(|setting| one.row(setting, cell_m)) {
            table.row(&fit_cells(row));
        }
    }
    table.0
}

fn fit_cells(row: &Row) -> Vec<String> {
    let flag = |flag: Flag| row.flags.get(flag.name()).copied().unwrap_or(0).to_string();
    let nodes = |mean: f64, most: u32| format!("{mean:.2} ({most})");
    vec![
        format!("{}, {}", row.dataset, row.setting),
        row.trees.to_string(),
        row.surfaces.to_string(),
        flag(Flag::NotElliptic),
        flag(Flag::CentreOutsideData),
        flag(Flag::ShapeBoundActive),
        flag(Flag::PriorActive),
        row.largest_gap.map_or("–".to_owned(), |gap| format!("{gap:.0e}")),
        row.mean_nodes
            .zip(row.most_nodes)
            .map_or("–".to_owned(), |(mean, most)| nodes(mean, most)),
        row.failures.to_string(),
    ]
}

/// A curve's name and its median for a dataset at the value of an index.
type Curve<'a> = (&'a str, &'a dyn Fn(&Assessed, usize) -> Option<f64>);

/// A table of medians over a parameter: a line for every value, a column for every curve.
fn sweep(name: &str, values: &[String], all: &[Assessed], curves: &[Curve<'_>]) -> String {
    let mut heading = vec![name.to_owned()];
    for one in all {
        heading.extend(curves.iter().map(|(curve, _)| format!("{}, {curve}", one.facts.dataset)));
    }
    let mut table = Table::new(&heading);
    for (index, value) in values.iter().enumerate() {
        let mut row = vec![value.clone()];
        for one in all {
            let medians = curves.iter().map(|(_, median)| median(one, index));
            row.extend(medians.map(|m| m.map_or("–".to_owned(), |m| format!("{m:.3}"))));
        }
        table.row(&row);
    }
    table.0
}

fn omega(all: &[Assessed], cell_m: f64) -> String {
    let values = omegas();
    let median = |one: &Assessed, index: usize, bounds: Bounds| {
        one.row(&Setting::l1(values[index], bounds), cell_m).map(|row| row.median_m)
    };
    let names: Vec<String> = values.iter().map(f64::to_string).collect();
    sweep(
        "ω",
        &names,
        all,
        &[
            ("paper's μ", &|one, index| median(one, index, Bounds::Paper)),
            ("exact bounds", &|one, index| median(one, index, Bounds::Exact)),
        ],
    )
}

fn delta(all: &[Assessed], cell_m: f64) -> String {
    let values = deltas_m();
    let median = |one: &Assessed, index: usize, free: Setting| {
        let setting = values.get(index).map_or(free, |delta| free.with_prior(*delta));
        one.row(&setting, cell_m).map(|row| row.median_m)
    };
    let mut names: Vec<String> = values.iter().map(|delta| format!("{delta} m")).collect();
    names.push("none".to_owned());
    let free = format!("ω = {OMEGA_WITH_PRIOR}");
    sweep(
        "δ",
        &names,
        all,
        &[
            ("ω = 0", &|one, index| median(one, index, Setting::l1(0.0, Bounds::Paper))),
            (&free, &|one, index| median(one, index, Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact))),
        ],
    )
}
