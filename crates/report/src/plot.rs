//! The plan of a plot: stems from above by diameter, and how far their branches reach.

use crate::Error;
use crate::canvas::{Canvas, Paint};
use crate::colour::{GREY, INK, Rgb, of_id};
use crate::figure::{Entry, Figure, Page, Symbol};
use crate::text::{Align, Style};
use timberline_artefact::Crs;
use timberline_pointcloud::Rect;

/// A tree of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotTree {
    /// Its id; it gives the colour.
    pub tree_id: u64,
    /// Where the stem stands, world, m.
    pub base_m: [f64; 2],
    /// Diameter at breast height, m; none where it is not known.
    pub dbh_m: Option<f64>,
    /// Positions that its branches reach, world, m: the crown is their convex hull.
    pub reach_m: Vec<[f64; 2]>,
    /// Whether it has a model.
    pub has_model: bool,
}

/// Stems without a model.
const LOST: Rgb = [213, 94, 0];
/// Stems are drawn at their size, but no smaller than this, in text heights.
const LEAST_STEM: f64 = 0.22;
/// Surroundings, m.
const MARGIN_M: f64 = 1.0;

/// Draws a plan.
///
/// # Errors
/// [`Error::Empty`] without trees, [`Error::Font`].
pub fn draw(title: &str, crs: &Crs, trees: &[PlotTree]) -> Result<Canvas, Error> {
    let mut extent = Rect { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };
    for place in trees.iter().flat_map(|tree| tree.reach_m.iter().chain([&tree.base_m])) {
        if place.iter().all(|value| value.is_finite()) {
            extent = extent.union(&Rect { min: *place, max: *place });
        }
    }
    if extent.min[0] > extent.max[0] {
        return Err(Error::Empty("there are no trees"));
    }
    let modelled = trees.iter().filter(|tree| tree.has_model).count();
    let mut legend = vec![
        Entry::Symbol(Symbol::Dot(INK), "stem, at its diameter".to_owned()),
        Entry::Symbol(Symbol::Ring(GREY), "reach of its branches".to_owned()),
    ];
    if modelled < trees.len() {
        legend.push(Entry::Symbol(Symbol::Cross(LOST), "stem without a model".to_owned()));
    }
    legend.push(Entry::Note("Numbers: diameter at breast height, cm".to_owned()));
    let subtitle = format!("{} trees, {modelled} with a model", trees.len());
    let extent = extent.grown(MARGIN_M);
    let page = Page { title, subtitle: &subtitle, extent, detail_m: 0.05, crs, legend };
    let mut figure = Figure::new(page)?;
    for tree in trees {
        crown(&mut figure, tree);
    }
    for tree in trees {
        stem(&mut figure, tree);
    }
    Ok(figure.finish())
}

fn crown(figure: &mut Figure<'_>, tree: &PlotTree) {
    let corners: Vec<[f64; 2]> = hull(&tree.reach_m).iter().map(|p| figure.px(*p)).collect();
    if corners.len() >= 3 {
        let colour = of_id(tree.tree_id);
        figure.canvas.polygon(&corners, Paint::sheer(colour, 0.18));
        figure.canvas.outline(&corners, 0.08 * figure.unit(), Paint::sheer(colour, 0.9));
    }
}

fn stem(figure: &mut Figure<'_>, tree: &PlotTree) {
    let unit = figure.unit();
    let [x, y] = figure.px(tree.base_m);
    let size =
        tree.dbh_m.map_or(0.0, |dbh_m| dbh_m / 2.0 * figure.px_per_m()).max(LEAST_STEM * unit);
    if tree.has_model {
        figure.canvas.disc([x, y], size, Paint::solid(INK));
    } else {
        let arm = 0.5 * unit;
        for sign in [-1.0, 1.0] {
            let line = [[x - arm, y - sign * arm], [x + arm, y + sign * arm]];
            figure.canvas.line(&line, 0.12 * unit, Paint::solid(LOST));
        }
    }
    if let Some(dbh_m) = tree.dbh_m {
        let style = Style::new(0.8 * unit, Paint::solid(INK)).align(Align::Left);
        let text = format!("{:.0}", dbh_m * 100.0);
        let fonts = figure.fonts.clone();
        fonts.write_on_map(&mut figure.canvas, &text, [x + size + 0.2 * unit, y - size], &style);
    }
}

/// Corners of the convex hull, in turn (Andrew 1979, monotone chain); those of fewer than three positions
/// are the positions.
fn hull(positions: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let is_finite = |p: &&[f64; 2]| p.iter().all(|value| value.is_finite());
    let mut sorted: Vec<[f64; 2]> = positions.iter().filter(is_finite).copied().collect();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let chain = |positions: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for position in positions {
            while let [.., a, b] = chain[..] {
                if turn(a, b, position) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(position);
        }
        chain.pop();
        chain
    };
    let mut corners = chain(&mut sorted.iter().copied());
    corners.extend(chain(&mut sorted.iter().rev().copied()));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_points_inside() {
        let mut points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let corners = points.clone();
        points.extend([[1.0, 1.0], [1.0, 0.0], [0.5, 1.5], [2.0, 2.0], [f64::NAN, 0.0]]);
        assert_eq!(hull(&points), corners);
        assert_eq!(hull(&[[1.0, 1.0], [1.0, 1.0]]), [[1.0, 1.0]]);
        assert_eq!(hull(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]).len(), 2);
    }

    #[test]
    fn a_plot_is_drawn_and_an_empty_one_refused() {
        let tree = |tree_id, x: f64, has_model: bool| PlotTree {
            tree_id,
            base_m: [x, 5.0],
            dbh_m: has_model.then_some(0.4),
            reach_m: vec![[x - 2.0, 4.0], [x + 2.0, 4.0], [x, 8.0]],
            has_model,
        };
        let crs = Crs::default();
        let canvas = draw("Plot", &crs, &[tree(1, 0.0, true), tree(2, 9.0, false)]).unwrap();
        let pixels = (0..i64::from(canvas.height()))
            .flat_map(|y| (0..i64::from(canvas.width())).map(move |x| (x, y)));
        let lost = pixels.filter(|(x, y)| canvas.pixel(*x, *y) == Some(LOST)).count();
        assert!(lost > 100, "{lost}");
        assert!(matches!(draw("Plot", &crs, &[]), Err(Error::Empty(_))));
        let alone = PlotTree { reach_m: Vec::new(), ..tree(3, 0.0, true) };
        draw("Plot", &crs, &[alone]).unwrap();
    }
}
