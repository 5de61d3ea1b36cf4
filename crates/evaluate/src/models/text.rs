//! The comparison of a plot's models as tables.

use super::{ModelAccuracy, PlotAccuracy, Size, VolumePair};
use crate::branches::BranchCounts;
use std::fmt;
use timberline_solids::DistanceSummary;

impl fmt::Display for PlotAccuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let share =
            |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.3}"));
        writeln!(
            f,
            "stems: {} true, {} found, {} missed, {} false; recall {}, precision {}",
            self.stems.reference,
            self.stems.matched,
            self.missed.len(),
            self.false_trees.len(),
            share(self.stems.recall()),
            share(self.stems.precision())
        )?;
        self.missed.iter().try_for_each(|tree| write_loner(f, "missed", tree))?;
        self.false_trees.iter().try_for_each(|tree| write_loner(f, "false", tree))?;
        write_trees(f, &self.trees)?;
        write_volumes(f, "volume of the trees found", &self.found_volumes)?;
        write_volumes(f, "volume of the plot", &self.plot_volumes)?;
        self.write_branches(f)?;
        self.write_distances(f)
    }
}

fn write_loner(f: &mut fmt::Formatter<'_>, what: &str, tree: &Size) -> fmt::Result {
    let [x, y] = tree.at_m;
    let (dbh, height) = (centimetres(tree.dbh_m), metres(tree.height_m));
    writeln!(f, "  {what}: tree {} at {x:.2} {y:.2}, DBH {dbh} cm, height {height} m", tree.id)
}

fn centimetres(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{:.1}", 100.0 * value))
}

fn metres(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
}

fn percent(share: f64) -> String {
    if share.is_finite() { format!("{:+.1}", 100.0 * share) } else { "-".to_owned() }
}

/// A line a tree: true and modelled values side by side, distances in millimetres.
fn write_trees(f: &mut fmt::Formatter<'_>, trees: &[ModelAccuracy]) -> fmt::Result {
    if trees.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "\n{:<6}{:>16}{:>8}{:>13}{:>15}{:>17}{:>8}{:>17}{:>17}{:>22}{:>6}{:>7}{:>18}{:>18}",
        "tree",
        "model",
        "off cm",
        "DBH cm",
        "height m",
        "stem l",
        "%",
        ">= 5 cm l",
        "< 5 cm l",
        "branches true/model",
        "lost",
        "false",
        "to truth mm",
        "to model mm"
    )?;
    let litres = |truth: f64, model: f64| format!("{:.1}/{:.1}", 1000.0 * truth, 1000.0 * model);
    let mean_and_rms =
        |d: &DistanceSummary| format!("{:.1}/{:.1}", 1000.0 * d.mean_m, 1000.0 * d.rms_m);
    for tree in trees {
        let (truth, model, counts) = (&tree.volumes.truth, &tree.volumes.model, &tree.branches.all);
        writeln!(
            f,
            "{:<6}{:>16}{:>8.1}{:>13}{:>15}{:>17}{:>8}{:>17}{:>17}{:>22}{:>6}{:>7}{:>18}{:>18}",
            tree.truth.id,
            tree.model.id,
            100.0 * tree.position_m,
            format!("{}/{}", centimetres(tree.truth.dbh_m), centimetres(tree.model.dbh_m)),
            format!("{}/{}", metres(tree.truth.height_m), metres(tree.model.height_m)),
            litres(truth.stem_m3, model.stem_m3),
            percent(tree.volumes.relative_errors()[0]),
            litres(truth.thick_m3, model.thick_m3),
            litres(truth.thin_m3, model.thin_m3),
            format!("{}/{}", counts.reference, counts.model),
            counts.missing(),
            counts.false_branches,
            mean_and_rms(&tree.surfaces.forth),
            mean_and_rms(&tree.surfaces.back),
        )?;
    }
    writeln!(f, "true/model; distances between surfaces: mean/RMS")
}

fn write_volumes(f: &mut fmt::Formatter<'_>, title: &str, pair: &VolumePair) -> fmt::Result {
    writeln!(f, "\n{title:<28}{:>10}{:>10}{:>10}", "true m3", "model m3", "error %")?;
    let (truth, model) = (&pair.truth, &pair.model);
    let rows = [
        ("stem", truth.stem_m3, model.stem_m3),
        ("branches from 5 cm", truth.thick_m3, model.thick_m3),
        ("branches below 5 cm", truth.thin_m3, model.thin_m3),
        ("all", truth.total_m3(), model.total_m3()),
    ];
    for ((name, truth, model), error) in rows.into_iter().zip(pair.relative_errors()) {
        writeln!(f, "{name:<28}{truth:>10.4}{model:>10.4}{:>10}", percent(error))?;
    }
    Ok(())
}

impl PlotAccuracy {
    fn write_branches(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{:<28}{:>8}{:>8}{:>9}{:>8}{:>8}{:>10}{:>10}{:>11}{:>9}",
            "branches of the trees found",
            "true",
            "found",
            "missing",
            "model",
            "false",
            "true m",
            "found m",
            "model m",
            "false m"
        )?;
        let border = |m: &f64| format!("{}", (1000.0 * m).round() / 10.0);
        let borders: Vec<String> = self.classes_m.iter().map(border).collect();
        for (class, counts) in self.branches.by_class.iter().enumerate() {
            let from = class.checked_sub(1).and_then(|below| borders.get(below));
            let name = match (from, borders.get(class)) {
                (Some(from), Some(to)) => format!("{from} to {to} cm"),
                (Some(from), None) => format!("from {from} cm"),
                (None, Some(to)) => format!("below {to} cm"),
                (None, None) => "any".to_owned(),
            };
            write_counts(f, &name, counts)?;
        }
        write_counts(f, "all", &self.branches.all)
    }

    fn write_distances(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "\n{:<42}{:>10}{:>9}{:>9}{:>9}{:>9}",
            "distances between surfaces (mm)", "samples", "mean", "RMS", "P95", "max"
        )?;
        let rows = [
            ("model to truth", &self.surfaces.forth),
            ("truth to model", &self.surfaces.back),
            ("stem and wood from 5 cm, model to truth", &self.thick_surfaces.forth),
            ("stem and wood from 5 cm, truth to model", &self.thick_surfaces.back),
        ];
        for (name, d) in rows {
            let [mean, rms, p95, max] = [d.mean_m, d.rms_m, d.p95_m, d.max_m].map(|m| 1000.0 * m);
            writeln!(f, "{name:<42}{:>10}{mean:>9.1}{rms:>9.1}{p95:>9.1}{max:>9.1}", d.count)?;
        }
        Ok(())
    }
}

fn write_counts(f: &mut fmt::Formatter<'_>, name: &str, c: &BranchCounts) -> fmt::Result {
    writeln!(
        f,
        "{name:<28}{:>8}{:>8}{:>9}{:>8}{:>8}{:>10.1}{:>10.1}{:>11.1}{:>9.1}",
        c.reference,
        c.found,
        c.missing(),
        c.model,
        c.false_branches,
        c.reference_m,
        c.found_m,
        c.model_m,
        c.false_m
    )
}
