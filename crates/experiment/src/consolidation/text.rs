//! Tables as text: CSV for programs, Markdown for people.

use super::summary::relative;
use super::{Assessed, Change, Figures, Mode, Row, Source, Thinned, changes};
use std::fmt::Write as _;

/// The improvement that the paper reports over AdTree, mean and root mean square distance.
const PAPER: [f64; 2] = [-0.3074, -0.2995];

/// One line for every model of every tree; lengths in metres.
#[must_use]
pub fn models_csv(all: &[Assessed]) -> String {
    let mut text = String::from(
        "tree,points,mode,skeleton_from,cloud_to_model_mean_m,cloud_to_model_rms_m,\
         cloud_to_model_p95_m,cloud_to_model_max_m,model_to_cloud_mean_m,model_to_cloud_rms_m,\
         model_to_cloud_p95_m,model_to_cloud_max_m,dbh_m,branches,cylinders,remark\n",
    );
    for tree in all {
        for row in &tree.rows {
            let head = [&tree.name, &tree.points.to_string(), row.mode.name(), row.source.name()];
            let cells = row.figures.as_ref().map_or(vec![String::new(); 11], cells);
            let remark = format!("\"{}\"", row.remark.replace('"', "\"\""));
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{},{},{remark}", head.join(","), cells.join(","));
        }
    }
    text
}

fn cells(figures: &Figures) -> Vec<String> {
    let lengths = [&figures.cloud_to_model, &figures.model_to_cloud]
        .map(|d| [d.mean_m, d.rms_m, d.p95_m, d.max_m]);
    let mut cells: Vec<String> =
        lengths.iter().flatten().map(|length| format!("{length:.6}")).collect();
    cells.push(figures.dbh_m.map(|dbh_m| format!("{dbh_m:.4}")).unwrap_or_default());
    cells.extend([figures.branches, figures.cylinders].map(|count| count.to_string()));
    cells
}

/// The report: changes over all trees, by tree, and all figures.
#[must_use]
pub fn markdown(all: &[Assessed]) -> String {
    let mut text = String::from(
        "Distances are those of the points as scanned, with either skeleton. `paper`: skeleton from points \
         consolidated in the paper's mode; `consolidated`: by default; `kept`: what the stage `cylinders` \
         keeps of scanned and consolidated.\n\n",
    );
    text += &overview(&changes(all));
    text += &by_tree(all);
    text += &points_table(all);
    text += &everything(all);
    text
}

fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:+.1} %", 100.0 * share) } else { "-".to_owned() }
}

fn overview(changes: &[Change]) -> String {
    let mut text = String::from(
        "## Over all trees\n\nMean over the trees of the relative change against the model from the points as scanned.\n\n\
         | mode | skeleton from | trees | better | cloud to model: mean | RMS | model to cloud: mean | \
         worst mean | DBH, mean difference |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for change in changes {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} ({}) | {:.1} cm |",
            change.mode.name(),
            change.source.name(),
            change.trees,
            change.better,
            percent(change.mean),
            percent(change.rms),
            percent(change.back),
            percent(change.worst),
            change.worst_tree,
            100.0 * change.dbh_m
        );
    }
    let [mean, rms] = PAPER.map(|share| format!("{:+.2} %", 100.0 * share));
    let _ = writeln!(text, "| AdTree | the paper's own | | | {mean} | {rms} | | | |\n");
    text
}

fn by_tree(all: &[Assessed]) -> String {
    let mut text = String::from(
        "## By tree\n\nMean / RMS distance from the points to the model from the points as scanned, mm, and \
         their changes.\n\n| tree | points | adtree: scanned | paper | consolidated | default: scanned | \
         paper | consolidated | kept |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for tree in all {
        let mut cells = vec![tree.name.clone(), tree.points.to_string()];
        for mode in Mode::ALL {
            let scanned = tree.figures(mode, Source::Scanned);
            cells.push(scanned.map_or("-".to_owned(), |figures| {
                let d = &figures.cloud_to_model;
                format!("{:.1} / {:.1}", 1e3 * d.mean_m, 1e3 * d.rms_m)
            }));
            let others = tree.rows.iter().filter(|row| row.mode == mode);
            let others = others.filter(|row| row.source != Source::Scanned);
            cells.extend(others.map(|row| changed(scanned, row)));
        }
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text + "\n"
}

fn changed(scanned: Option<&Figures>, row: &Row) -> String {
    let (Some(before), Some(after)) = (scanned, &row.figures) else { return "skipped".to_owned() };
    if row.source == Source::Kept && row.remark != "consolidated" {
        return "scanned".to_owned();
    }
    let (before, after) = (&before.cloud_to_model, &after.cloud_to_model);
    let changes = [relative(before.mean_m, after.mean_m), relative(before.rms_m, after.rms_m)];
    changes.map(percent).join(" / ")
}

fn points_table(all: &[Assessed]) -> String {
    let mut text = String::from(
        "## Points\n\nMedian thickness of the cloud across its surface where it could be moved, before and \
         after.\n\n| tree | points | paper: points | thickness | default: points | thickness | remark |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for tree in all {
        let cells = tree.thinned.map(|thinned| match thinned {
            None => "- | -".to_owned(),
            Some(Thinned { points: 0, thickness_before_m, .. }) => {
                format!("skipped | {:.1} mm", 1e3 * thickness_before_m)
            }
            Some(Thinned { points, thickness_before_m, thickness_after_m }) => {
                let [before, after] = [thickness_before_m, thickness_after_m].map(|m| 1e3 * m);
                format!("{points} | {before:.1} -> {after:.1} mm")
            }
        });
        let kept = tree.rows.iter().find(|row| row.source == Source::Kept);
        let remark = kept.map_or("", |row| row.remark.as_str());
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {remark} |",
            tree.name, tree.points, cells[0], cells[1]
        );
    }
    text + "\n"
}

fn everything(all: &[Assessed]) -> String {
    let mut text = String::from(
        "## All models\n\n| tree | mode | skeleton from | cloud to model: mean / RMS / P95 / max mm | model to \
         cloud: mean / RMS mm | DBH cm | branches | cylinders |\n|---|---|---|---|---|---|---|---|\n",
    );
    for tree in all {
        for row in &tree.rows {
            let Some(figures) = &row.figures else { continue };
            let (to, back) = (&figures.cloud_to_model, &figures.model_to_cloud);
            let to = [to.mean_m, to.rms_m, to.p95_m, to.max_m].map(|m| format!("{:.1}", 1e3 * m));
            let back = [back.mean_m, back.rms_m].map(|m| format!("{:.1}", 1e3 * m));
            let dbh = figures.dbh_m.map_or("-".to_owned(), |m| format!("{:.1}", 100.0 * m));
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {} | {dbh} | {} | {} |",
                tree.name,
                row.mode.name(),
                row.source.name(),
                to.join(" / "),
                back.join(" / "),
                figures.branches,
                figures.cylinders
            );
        }
    }
    text
}
