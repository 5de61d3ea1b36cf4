//! Tables as text: CSV for programs, Markdown for people.

use super::compare::{Outcome, Pooled};
use super::judge::{FoundRow, TrueRow};
use super::method::{Method, methods};
use super::plan::Experiment;
use super::plot::BEYOND_M;
use super::real::{BoxRow, ClipRow};
use super::summary::{LAYERS, Summary, class_names};
use std::fmt::Write as _;
use timberline_evaluate::{Accuracy, ErrorStats, Layer, MatchRule};

/// One line for every case and segmenter; lengths in metres.
#[must_use]
pub fn cases_csv(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "stand,density_per_m2,repeat,segmenter,points_per_m2,pulses_per_m2,group,true_trees,\
         true_found,found_trees,found_true,recall,precision,f,top_rmse_m,top_median_m,stem_rmse_m,\
         stem_median_m,height_bias_m,height_rmse_m,hull_iou,crown_iou,tree_purity,\
         tree_completeness,point_purity,point_completeness\n",
    );
    for outcome in outcomes {
        let case = &outcome.case;
        let head = format!(
            "{},{},{},{},{:.2},{:.2}",
            case.stand,
            case.density_per_m2,
            case.repeat,
            outcome.method,
            outcome.density_per_m2,
            outcome.pulses_per_m2
        );
        let summary = &outcome.summary;
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{head},{},{}", accuracy(&summary.all), errors(summary));
        let groups = [&summary.with_height, &summary.visible, &summary.segments];
        for group in groups.into_iter().chain(&summary.by_height).chain(&summary.by_layer) {
            let _ = writeln!(text, "{head},{}{}", accuracy(group), ",".repeat(12));
        }
    }
    text
}

fn accuracy(group: &Accuracy) -> String {
    let shares = [group.recall(), group.precision(), group.f_score()];
    format!(
        "{},{},{},{},{},{}",
        group.group,
        group.reference,
        group.found,
        group.detected.unwrap_or(0),
        group.correct,
        shares.map(share).join(",")
    )
}

fn share(value: Option<f64>) -> String {
    value.map(|value| format!("{value:.4}")).unwrap_or_default()
}

fn errors(summary: &Summary) -> String {
    let (top, stem) = (&summary.top_error_m, &summary.stem_error_m);
    let height = &summary.height_error_m;
    let metres = [top.rmse, top.median, stem.rmse, stem.median, height.bias, height.rmse];
    let metres = metres.map(|value| if top.n > 0 { format!("{value:.3}") } else { String::new() });
    let shares = [
        summary.hull_iou,
        summary.crown_iou,
        summary.tree_purity,
        summary.tree_completeness,
        summary.point_purity,
        summary.point_completeness,
    ];
    format!("{},{}", metres.join(","), shares.map(share).join(","))
}

/// One line for every judged tree of every case and segmenter: true trees with what was found of
/// them, then found trees that are none; lengths in metres.
#[must_use]
pub fn trees_csv(outcomes: &[Outcome]) -> String {
    let mut text = String::from(
        "stand,density_per_m2,repeat,segmenter,is,tree,found_tree,x_m,y_m,height_m,layer,visible,\
         points,found_points,shared_points,top_error_m,stem_error_m,height_error_m,hull_iou,\
         crown_iou\n",
    );
    for outcome in outcomes {
        let case = &outcome.case;
        let head =
            format!("{},{},{},{}", case.stand, case.density_per_m2, case.repeat, outcome.method);
        for tree in &outcome.judged.trees {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{head},{}", true_line(tree));
        }
        for tree in outcome.judged.found.iter().filter(|tree| tree.is.is_none()) {
            let _ = writeln!(text, "{head},{}", false_line(tree));
        }
    }
    text
}

fn layer(layer: Option<Layer>) -> &'static str {
    match layer {
        Some(Layer::Upper) => "upper",
        Some(Layer::Middle) => "middle",
        Some(Layer::Lower) => "lower",
        None => "",
    }
}

fn true_line(tree: &TrueRow) -> String {
    let [x, y] = tree.top_m;
    let head = |is: &str, found: &str| {
        format!(
            "{is},{},{found},{x:.2},{y:.2},{:.2},{},{},{}",
            tree.id,
            tree.height_m,
            layer(tree.layer),
            u8::from(tree.visible),
            tree.points
        )
    };
    let Some(hit) = &tree.hit else { return head("missed", "") + &",".repeat(7) };
    format!(
        "{},{},{},{:.3},{:.3},{:.3},{:.4},{:.4}",
        head("found", &hit.id.to_string()),
        hit.found_points,
        hit.shared_points,
        hit.top_error_m,
        hit.stem_error_m,
        hit.height_error_m,
        hit.hull_iou,
        hit.crown_iou
    )
}

fn false_line(tree: &FoundRow) -> String {
    let ([x, y], layer) = (tree.top_m, layer(tree.layer));
    let head = format!("false,,{},{x:.2},{y:.2},{:.2},{layer},,", tree.id, tree.height_m);
    format!("{head},{}{}", tree.points, ",".repeat(6))
}

/// A Markdown table under construction.
struct Table(String);

impl Table {
    /// The first columns hold text, the others numbers.
    fn new(heading: &[&str], text_columns: usize) -> Self {
        let mut table = Self(String::new());
        table.row(heading.iter().map(|cell| (*cell).to_owned()));
        let rule = |i| if i < text_columns { "---" } else { "---:" }.to_owned();
        table.row((0..heading.len()).map(rule));
        table
    }

    fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        let cells: Vec<String> = cells.into_iter().collect();
        self.0 += &format!("| {} |\n", cells.join(" | "));
    }
}

fn three(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"))
}

/// The report on generated stands.
#[must_use]
pub fn markdown(experiment: &Experiment, pooled: &[Pooled]) -> String {
    let mut text = String::from("# Segmenters compared\n\n");
    text += &introduction(experiment, pooled);
    let found = tree_sets(pooled);
    text += "\n## Trees\n\n";
    text += &trees(&found);
    text += "\n## Errors of the trees found\n\n";
    text += &errors_table(&found);
    text += "\n## By class of height: F (true trees)\n\n";
    let classes = class_names(&experiment.height_edges_m);
    text += &groups(&found, &classes, |summary| &summary.by_height);
    text += "\n## By canopy layer: F (true trees)\n\n";
    let layers: Vec<String> = LAYERS.iter().map(ToString::to_string).collect();
    text += &groups(&found, &layers, |summary| &summary.by_layer);
    text += "\n## Points and crowns\n\n";
    text += POINTS;
    text += &points(pooled);
    text
}

/// What the columns of the last table are.
const POINTS: &str = "Points from 1 m above the ground on. *Segments*: F of trees of which a segment holds half \
    (intersection over union of the points from 0.5 on). Of all points: those of false and of missed trees count, \
    too; of a tree: means over the trees found. *Hulls*: mean overlap of the convex hulls of the found and the true \
    crown's points; *true crown*: with the widest section of the crown's envelope, which neighbours may reach into. \
    A crown's points are those above 0.3 of its height.\n\n";

/// What finds the trees of the segmenters that do not themselves.
pub const DETECTION: &str = "detection";

/// A row for every set of trees: that of the detection under its own name, whatever the segmenters
/// that took it over.
#[must_use]
pub fn tree_sets(pooled: &[Pooled]) -> Vec<Pooled> {
    let mut rows: Vec<Pooled> = Vec::new();
    for one in pooled {
        let method = if one.own_trees { one.method } else { DETECTION };
        let same = |row: &Pooled| row.case == one.case && row.method == method;
        if !rows.iter().any(same) {
            rows.push(Pooled { method, ..one.clone() });
        }
    }
    rows
}

fn introduction(experiment: &Experiment, pooled: &[Pooled]) -> String {
    let matching = &experiment.matching;
    let rule = match matching.rule {
        MatchRule::Optimal => "as many pairs as possible, then the least sum of distances",
        MatchRule::TallestFirst => "the tallest true tree chooses first, each the nearest",
    };
    let difference = matching
        .max_height_difference_m
        .map_or_else(String::new, |limit| format!(" and {limit} m in height"));
    let crowns = crowns(experiment);
    let is_shown = |method: &Method| pooled.iter().any(|row| row.method == method.name);
    let segmenters: String = methods()
        .iter()
        .filter(|method| is_shown(method))
        .map(|method| format!("* `{}`: {}.\n", method.name, method.about))
        .collect();
    format!(
        "Seed {}, {} repetition(s): squares of {} m, scanned {} m further in stands that reach {} m further, \
         on ground of {} degrees{crowns}. A tree counts from {} m of height on, whether it can be seen from above or not. A \
         found tree is a true one when their crown tops are not more than {} m apart in the \
         plane{difference}; {rule}. *Heights alike*: they must \
         not differ by more than {} m, either. *Visible trees*: nothing hangs over their tops; found trees \
         that are hidden ones do not count. Layers are upper, middle and lower thirds of the top height within \
         {} m. Density is that of all returns.\n\n{segmenters}",
        experiment.seed,
        experiment.repeats,
        experiment.judged_edge_m,
        experiment.margin_m,
        experiment.margin_m + BEYOND_M,
        experiment.slope_deg,
        experiment.min_height_m,
        matching.max_distance_m,
        experiment.max_height_difference_m,
        experiment.layer_radius_m
    )
}

/// What is unusual about the crowns.
fn crowns(experiment: &Experiment) -> String {
    let mut text = String::new();
    if experiment.crown_scale != 1.0 {
        text += &format!(", crowns {} times as wide", experiment.crown_scale);
    }
    if experiment.crown_relief > 0.0 {
        text += &format!(", crowns dented {} times as is common", experiment.crown_relief);
    }
    text
}

fn head(pooled: &Pooled) -> Vec<String> {
    let case = &pooled.case;
    vec![case.stand.to_string(), pooled.method.to_owned(), format!("{:.1}", pooled.density_per_m2)]
}

fn trees(pooled: &[Pooled]) -> String {
    let heading = [
        "stand",
        "trees of",
        "points/m²",
        "pulses/m²",
        "true trees",
        "found trees",
        "recall",
        "precision",
        "F",
        "F, least and most",
        "F, heights alike",
        "F, visible trees",
    ];
    let mut table = Table::new(&heading, 2);
    for one in pooled {
        let (all, visible) = (&one.summary.all, &one.summary.visible);
        let range = one.f_range.map(|[low, high]| format!("{low:.3} to {high:.3}"));
        let mut cells = head(one);
        cells.extend([
            format!("{:.1}", one.pulses_per_m2),
            all.reference.to_string(),
            all.detected.unwrap_or(0).to_string(),
            three(all.recall()),
            three(all.precision()),
            three(all.f_score()),
            range.unwrap_or_default(),
            three(one.summary.with_height.f_score()),
            three(visible.f_score()),
        ]);
        table.row(cells);
    }
    table.0
}

fn errors_table(pooled: &[Pooled]) -> String {
    let heading = [
        "stand",
        "trees of",
        "points/m²",
        "top, RMSE m",
        "top, median m",
        "stem, RMSE m",
        "stem, median m",
        "height, bias m",
        "height, RMSE m",
    ];
    let mut table = Table::new(&heading, 2);
    for one in pooled {
        let summary = &one.summary;
        let (top, stem) = (&summary.top_error_m, &summary.stem_error_m);
        let height = &summary.height_error_m;
        let values = [top.rmse, top.median, stem.rmse, stem.median, height.bias, height.rmse];
        let mut cells = head(one);
        cells.extend(values.map(|value| three((top.n > 0).then_some(value))));
        table.row(cells);
    }
    table.0
}

fn groups(pooled: &[Pooled], names: &[String], of: impl Fn(&Summary) -> &Vec<Accuracy>) -> String {
    let mut heading = vec!["stand", "trees of", "points/m²"];
    heading.extend(names.iter().map(String::as_str));
    let mut table = Table::new(&heading, 2);
    for one in pooled {
        let mut cells = head(one);
        cells.extend(of(&one.summary).iter().map(|group| match group.reference {
            0 => "–".to_owned(),
            count => format!("{} ({count})", three(group.f_score().or(Some(0.0)))),
        }));
        table.row(cells);
    }
    table.0
}

fn points(pooled: &[Pooled]) -> String {
    let heading = [
        "stand",
        "segmenter",
        "points/m²",
        "F of segments",
        "purity of all points",
        "completeness of all points",
        "purity of a tree",
        "completeness of a tree",
        "IoU of hulls",
        "IoU with true crown",
    ];
    let mut table = Table::new(&heading, 2);
    for one in pooled {
        let summary = &one.summary;
        let values = [
            summary.segments.f_score(),
            summary.point_purity,
            summary.point_completeness,
            summary.tree_purity,
            summary.tree_completeness,
            summary.hull_iou,
            summary.crown_iou,
        ];
        let mut cells = head(one);
        cells.extend(values.map(three));
        table.row(cells);
    }
    table.0
}

/// The report on real scans, without a heading of its own; nothing without scans.
#[must_use]
pub fn real_markdown(boxes: &[BoxRow], clips: &[ClipRow]) -> String {
    let mut text = String::new();
    if !boxes.is_empty() {
        text += "\n## Crowns drawn by hand\n\n";
        text += BOXES;
        text += &boxes_table(boxes);
    }
    if !clips.is_empty() {
        text += "\n## Measured single trees\n\n";
        text += CLIPS;
        text += &clips_table(clips);
    }
    text
}

const BOXES: &str = "A tree's box is that around its crown's points; it is a drawn one when they overlap by 0.4 or more \
    (intersection over union). Points from 1 m above the ground on: *purity* of those in boxes and trees, \
    *completeness* of those in boxes, and the share of the trees' points that is *in boxes*.\n\n";

const CLIPS: &str = "The tree of a clip is the found one nearest to the measured top, within 2 m. Right is a height within 1 m and \
    a crown's diameter (of the circle with the area of its polygon) within 20 % of what was measured; clips without a tree \
    count as wrong. The clips are hardly wider than the crowns, so that diameters say little.\n\n";

fn boxes_table(rows: &[BoxRow]) -> String {
    let heading = [
        "scan",
        "segmenter",
        "boxes",
        "trees",
        "matched",
        "recall",
        "precision",
        "mean IoU",
        "purity",
        "completeness",
        "in boxes",
    ];
    let mut table = Table::new(&heading, 2);
    for row in rows {
        let shares = [row.recall, row.precision, row.mean_iou, Some(row.purity)];
        let mut cells = vec![row.scan.clone(), row.method.to_owned()];
        cells.extend([row.boxes, row.found, row.matched].map(|count| count.to_string()));
        cells.extend(shares.map(three));
        cells.extend([row.completeness, row.in_boxes].map(|share| three(Some(share))));
        table.row(cells);
    }
    table.0
}

fn clips_table(rows: &[ClipRow]) -> String {
    let heading = [
        "segmenter",
        "clips",
        "found",
        "height right",
        "diameter right",
        "both right",
        "height, bias m",
        "height, RMSE m",
        "diameter, median ratio",
        "trees in all clips",
    ];
    let mut names: Vec<&str> = Vec::new();
    for row in rows {
        if !names.contains(&row.method) {
            names.push(row.method);
        }
    }
    let mut table = Table::new(&heading, 1);
    for name in names {
        let own: Vec<&ClipRow> = rows.iter().filter(|row| row.method == name).collect();
        table.row(clip_cells(name, &own));
    }
    table.0
}

fn clip_cells(name: &str, rows: &[&ClipRow]) -> Vec<String> {
    let count = |is: &dyn Fn(&ClipRow) -> bool| rows.iter().filter(|row| is(row)).count();
    let of = |right: usize| format!("{right} ({:.0} %)", 100.0 * right as f64 / rows.len() as f64);
    let height = rows.iter().filter_map(|row| Some(row.found_height_m? - row.height_m));
    let height = ErrorStats::of(height);
    let ratio = rows.iter().filter_map(|row| Some(row.found_diameter_m? / row.crown_diameter_m));
    let both = count(&|row| row.height_is_right() && row.diameter_is_right());
    vec![
        name.to_owned(),
        rows.len().to_string(),
        count(&|row| row.distance_m.is_some()).to_string(),
        of(count(&ClipRow::height_is_right)),
        of(count(&ClipRow::diameter_is_right)),
        of(both),
        format!("{:.3}", height.bias),
        format!("{:.3}", height.rmse),
        format!("{:.3}", ErrorStats::of(ratio).median),
        rows.iter().map(|row| row.trees).sum::<usize>().to_string(),
    ]
}

/// One line for every clip and segmenter; lengths in metres.
#[must_use]
pub fn clips_csv(rows: &[ClipRow]) -> String {
    let mut text = String::from(
        "clip,segmenter,height_m,crown_diameter_m,trees,distance_m,found_height_m,found_diameter_m\n",
    );
    let number = |value: Option<f64>| value.map(|value| format!("{value:.3}")).unwrap_or_default();
    for row in rows {
        let found = [row.distance_m, row.found_height_m, row.found_diameter_m].map(number);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{},{},{:.3},{:.3},{},{}",
            row.clip.replace([',', '\n', '"'], " "),
            row.method,
            row.height_m,
            row.crown_diameter_m,
            row.trees,
            found.join(",")
        );
    }
    text
}
