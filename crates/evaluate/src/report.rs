//! Everything assessed about a result, to serialise and to print.

use crate::{Accuracy, BoxAccuracy, ErrorStats, LabelAccuracy, PlotAccuracy, TreeAccuracy};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Error statistics of a named quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedErrors {
    /// What was measured.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The statistics.
    pub errors: ErrorStats,
}

/// Distances of positions from the stems, by one method of finding positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodErrors {
    /// The method, with its parameters.
    pub method: String,
    /// Trees whose crown gave no surface with an apex; none of methods that need no surface.
    pub without_surface: Option<usize>,
    /// Statistics of the distances in the plane, metres: the bias is their mean.
    pub errors: ErrorStats,
}

/// A report; parts that were not assessed are missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// What was assessed.
    pub title: String,
    /// Trees found.
    pub trees: Option<TreeAccuracy>,
    /// Crown boxes.
    pub boxes: Option<BoxAccuracy>,
    /// Point labels.
    pub labels: Option<LabelAccuracy>,
    /// Other quantities, for example the terrain model.
    pub errors: Vec<NamedErrors>,
    /// Methods of finding positions, side by side.
    #[serde(default)]
    pub positions: Vec<MethodErrors>,
    /// Models of the trees of a plot.
    #[serde(default)]
    pub models: Option<PlotAccuracy>,
}

impl Report {
    /// An empty report.
    #[must_use]
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Adds the errors of a quantity.
    pub fn add_errors(&mut self, name: &str, unit: &str, errors: ErrorStats) {
        self.errors.push(NamedErrors { name: name.to_owned(), unit: unit.to_owned(), errors });
    }

    fn all_errors(&self) -> Vec<NamedErrors> {
        let mut all = self.models.as_ref().map_or_else(Vec::new, PlotAccuracy::errors);
        if let Some(trees) = &self.trees {
            let of_trees = [
                ("position", "m", trees.position_m),
                ("tree height", "m", trees.height_m),
                ("crown diameter", "m", trees.crown_diameter_m),
                ("crown diameter", "ratio", trees.crown_diameter_ratio),
            ];
            let named = |(name, unit, errors): (&str, &str, ErrorStats)| NamedErrors {
                name: name.to_owned(),
                unit: unit.to_owned(),
                errors,
            };
            all.extend(of_trees.into_iter().filter(|row| row.2.n > 0).map(named));
        }
        all.extend(self.errors.iter().cloned());
        all
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        if let Some(trees) = &self.trees {
            write_trees(f, trees)?;
        }
        if let Some(boxes) = &self.boxes {
            let (count, mean) = (boxes.pairs.len(), number(boxes.mean_iou()));
            writeln!(
                f,
                "\ncrown boxes: {count} of {} found, {} detected, recall {}, precision {}, mean IoU {mean}",
                boxes.reference,
                boxes.detected,
                number(boxes.recall()),
                number(boxes.precision())
            )?;
        }
        if let Some(labels) = &self.labels {
            writeln!(
                f,
                "\npoint labels: {} trees, {} found, completeness {:.3}, purity {:.3}, mean IoU {:.3}",
                labels.trees.len(),
                labels.found_trees,
                labels.completeness,
                labels.purity,
                labels.mean_iou
            )?;
        }
        if let Some(models) = &self.models {
            write!(f, "\n{models}")?;
        }
        write_errors(f, &self.all_errors())?;
        write_positions(f, &self.positions)
    }
}

fn write_positions(f: &mut fmt::Formatter<'_>, rows: &[MethodErrors]) -> fmt::Result {
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "\n{:<50}{:>7}{:>12}{:>9}{:>9}{:>9}{:>9}{:>9}",
        "position error by method (m)", "n", "no surface", "median", "mean", "RMSE", "P95", "max"
    )?;
    for MethodErrors { method, without_surface, errors: e } in rows {
        let without = without_surface.map_or_else(dash, |count| count.to_string());
        writeln!(
            f,
            "{method:<50}{:>7}{without:>12}{:>9.3}{:>9.3}{:>9.3}{:>9.3}{:>9.3}",
            e.n, e.median, e.bias, e.rmse, e.p95_abs, e.max_abs
        )?;
    }
    Ok(())
}

fn write_trees(f: &mut fmt::Formatter<'_>, trees: &TreeAccuracy) -> fmt::Result {
    writeln!(
        f,
        "\n{:<14}{:>10}{:>8}{:>10}{:>9}{:>8}{:>11}{:>8}",
        "trees", "reference", "found", "detected", "correct", "recall", "precision", "F"
    )?;
    let rows = std::iter::once(&trees.all).chain(&trees.by_height).chain(&trees.by_layer);
    rows.into_iter().try_for_each(|row| write_accuracy(f, row))
}

fn write_accuracy(f: &mut fmt::Formatter<'_>, row: &Accuracy) -> fmt::Result {
    let count = |n: usize| row.detected.map_or_else(dash, |_| n.to_string());
    writeln!(
        f,
        "{:<14}{:>10}{:>8}{:>10}{:>9}{:>8}{:>11}{:>8}",
        row.group,
        row.reference,
        row.found,
        count(row.detected.unwrap_or(0)),
        count(row.correct),
        number(row.recall()),
        number(row.precision()),
        number(row.f_score()),
    )
}

fn write_errors(f: &mut fmt::Formatter<'_>, rows: &[NamedErrors]) -> fmt::Result {
    if rows.is_empty() {
        return Ok(());
    }
    writeln!(
        f,
        "\n{:<24}{:>9}{:>9}{:>9}{:>9}{:>11}{:>9}{:>9}",
        "errors", "n", "bias", "median", "RMSE", "median |e|", "P95 |e|", "max |e|"
    )?;
    for row in rows {
        let name = format!("{} ({})", row.name, row.unit);
        let e = &row.errors;
        writeln!(
            f,
            "{name:<24}{:>9}{:>9.3}{:>9.3}{:>9.3}{:>11.3}{:>9.3}{:>9.3}",
            e.n, e.bias, e.median, e.rmse, e.median_abs, e.p95_abs, e.max_abs
        )?;
    }
    Ok(())
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(dash, |value| format!("{value:.3}"))
}

fn dash() -> String {
    "-".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layer, MatchParams, Tree, assess_trees, match_boxes};
    use timberline_pointcloud::Rect;

    fn example() -> Report {
        let tree = |id, x, height_m| Tree { id, at_m: [x, 0.0], height_m, ..Tree::default() };
        let mut reference = [tree(1, 0.0, 20.0), tree(2, 5.0, 12.0)];
        reference[0].layer = Some(Layer::Upper);
        let detected = [tree(1, 0.5, 19.5), tree(2, 9.0, 11.0)];
        let square = Rect { min: [0.0; 2], max: [1.0; 2] };
        let mut report = Report::new("a stand");
        let params = MatchParams::default();
        report.trees = Some(assess_trees(&reference, &detected, &params, &[15.0]).unwrap());
        report.boxes = Some(match_boxes(&[square], &[square], 0.4).unwrap());
        report.labels = Some(crate::assess_labels(&[1, 1], &[2, 0]).unwrap());
        report.add_errors("terrain", "m", ErrorStats::of([0.25, -0.25]));
        let method = |method: &str, without_surface, errors| MethodErrors {
            method: method.to_owned(),
            without_surface,
            errors: ErrorStats::of(errors),
        };
        report.positions = vec![
            method("highest point", None, [0.25, 0.75]),
            method("L2, free axes", Some(1), [0.5, 0.5]),
        ];
        report
    }

    const EXPECTED: &str = "\
a stand

trees          reference   found  detected  correct  recall  precision       F
all trees              2       1         2        1   0.500      0.500   0.500
below 15 m             1       0         1        0   0.000      0.000   0.000
from 15 m              1       1         1        1   1.000      1.000   1.000
upper layer            1       1         -        -   1.000          -       -

crown boxes: 1 of 1 found, 1 detected, recall 1.000, precision 1.000, mean IoU 1.000

point labels: 1 trees, 1 found, completeness 0.500, purity 1.000, mean IoU 0.500

errors                          n     bias   median     RMSE median |e|  P95 |e|  max |e|
position (m)                    1    0.500    0.500    0.500      0.500    0.500    0.500
tree height (m)                 1   -0.500   -0.500    0.500      0.500    0.500    0.500
terrain (m)                     2    0.000    0.000    0.250      0.250    0.250    0.250

position error by method (m)                            n  no surface   median     mean     RMSE      P95      max
highest point                                           2           -    0.500    0.500    0.559    0.725    0.750
L2, free axes                                           2           1    0.500    0.500    0.500    0.500    0.500
";

    #[test]
    fn prints_as_tables() {
        assert_eq!(example().to_string(), EXPECTED);
    }

    #[test]
    fn an_empty_report_is_its_title() {
        assert_eq!(Report::new("nothing").to_string(), "nothing\n");
    }

    #[test]
    fn serialises_and_comes_back() {
        let report = example();
        let json = serde_json::to_string(&report).unwrap();
        assert_eq!(serde_json::from_str::<Report>(&json).unwrap(), report);
    }
}
