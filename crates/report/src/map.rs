//! The map of a site: terrain relief, canopy, crowns and treetops.

use crate::canvas::{Canvas, Paint};
use crate::colour::{INK, NO_DATA, PAPER, Rgb, VIRIDIS, lit, mix};
use crate::figure::{Entry, Figure, Page, Symbol, draw_symbol};
use crate::hillshade::{exaggeration, hillshade};
use crate::{Error, Grid};
use timberline_artefact::Crs;
use timberline_pointcloud::{Rect, Window};

/// Heights between which the canopy's colour covers the relief, metres.
const COVER_M: [f64; 2] = [0.5, 2.0];
/// Share of canopy cells left out at the upper end of the ramp (single high returns).
const LEFT_OUT: f64 = 0.002;
/// Neighbouring cells of the canopy are smoothed when their heights differ by less, metres.
const SAME_CROWN_M: f64 = 3.0;
/// Light on level ground is brought to this.
const LEVEL_LIGHT: f64 = 0.88;
/// Crowns narrower than this many pixels have no outline.
const NARROWEST_CROWN_PX: f64 = 8.0;
/// Width of a crown's outline, metres, within what can be drawn.
const OUTLINE_M: f64 = 0.22;

/// A tree on the map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapTree {
    /// World position of the highest point, metres.
    pub top_m: [f64; 2],
    /// Crown outline, world, metres; may be empty.
    pub crown_m: Vec<[f64; 2]>,
}

/// What a map shows.
#[derive(Debug, Clone, PartialEq)]
pub struct MapContents<'a> {
    /// Heading.
    pub title: &'a str,
    /// A line below it.
    pub subtitle: &'a str,
    /// The area, metres.
    pub extent: Rect,
    /// The CRS.
    pub crs: &'a Crs,
    /// Terrain, metres.
    pub terrain: &'a Grid,
    /// Height of the canopy above ground, metres.
    pub canopy: &'a Grid,
    /// The trees.
    pub trees: &'a [MapTree],
}

/// Draws the map of a site.
///
/// # Errors
/// [`Error::Empty`], [`Error::Font`].
pub fn draw(contents: &MapContents<'_>) -> Result<Canvas, Error> {
    let MapContents { extent, terrain, canopy, .. } = contents;
    let top = canopy.range(LEFT_OUT).map_or(1.0, |[_, high]| high.max(1.0));
    let steepening = exaggeration(terrain);
    let mut figure = Figure::new(Page {
        title: contents.title,
        subtitle: contents.subtitle,
        extent: extent.grown(extent.size()[0].max(extent.size()[1]) * 0.01),
        detail_m: canopy.cell_m,
        crs: contents.crs,
        legend: legend(top, !contents.trees.is_empty(), steepening),
    })?;
    // What is seen of the surfaces is made band by band: for a whole map it is larger than they are.
    figure.paint(|rows| {
        let drawn = without_pits(canopy, canopy.rows_around(rows, 1));
        let light = Light {
            terrain: hillshade(terrain, steepening, terrain.rows_around(rows, 0)),
            canopy: hillshade(&drawn, 1.0, canopy.rows_around(rows, 0)),
        };
        move |at| pixel(at, &drawn, &light, top)
    });
    draw_crowns(&mut figure, contents.trees);
    draw_tops(&mut figure, contents.trees);
    Ok(figure.finish())
}

/// The cells of a window of the canopy as they are drawn: a cell far below most of its neighbours (a pulse that went through a
/// crown, Khosravipour et al. 2014, PE&RS 80(9)) takes their median.
fn without_pits(canopy: &Grid, window: Window) -> Grid {
    const PIT_M: f64 = 4.0;
    let mut drawn = Grid::empty(window, canopy.cell_m);
    for row in window.row0..window.end_row() {
        for column in window.column0..window.end_column() {
            let Some(own) = canopy.get(column, row) else { continue };
            let around = (-1..=1).flat_map(|dr| (-1..=1).map(move |dc| (column + dc, row + dr)));
            let (mut heights, mut count) = ([0.0; 9], 0);
            for height in around.filter_map(|(c, r)| canopy.get(c, r)) {
                heights[count] = height;
                count += 1;
            }
            heights[..count].sort_unstable_by(f64::total_cmp);
            let median = heights[(count - 1) / 2];
            let height = if own < median - PIT_M { median } else { own };
            drawn.values[window.index(column, row)] = height as f32;
        }
    }
    drawn
}

fn legend(top: f64, has_trees: bool, steepening: f64) -> Vec<Entry> {
    let title = "Canopy height [m]".to_owned();
    let mut entries = vec![Entry::Ramp { title, ramp: VIRIDIS, range: [0.0, top] }];
    if has_trees {
        entries.push(Entry::Symbol(Symbol::Dot(PAPER), "treetop".to_owned()));
        entries.push(Entry::Symbol(Symbol::Crown(VIRIDIS.at(0.55)), "crown outline".to_owned()));
    }
    entries.push(Entry::Symbol(Symbol::Swatch(ground_colour(0.5)), "ground, shaded".to_owned()));
    entries.push(Entry::Symbol(Symbol::Swatch(NO_DATA), "no data".to_owned()));
    if steepening > 1.05 {
        entries.push(Entry::Note(format!("relief steepened {steepening:.1} times")));
    }
    entries
}

/// Shading of the two surfaces.
struct Light {
    terrain: Grid,
    canopy: Grid,
}

/// The colour of ground in a light from 0 to 1.
fn ground_colour(light: f64) -> Rgb {
    lit([244, 238, 226], (light / 0.5 * LEVEL_LIGHT).min(1.0))
}

fn pixel(at: [f64; 2], canopy: &Grid, light: &Light, top: f64) -> Rgb {
    let terrain_light = light.terrain.sample(at);
    let ground = terrain_light.map_or(NO_DATA, ground_colour);
    let Some(height) = canopy.sample_like(at, SAME_CROWN_M) else { return ground };
    let crown_light = light.canopy.sample(at).unwrap_or(0.5);
    // A crown stands in the light of the slope and in that of its own surface.
    let shade = 0.55 + 0.5 * terrain_light.unwrap_or(0.5) + 0.4 * (crown_light - 0.5);
    let crown = lit(VIRIDIS.at(height / top), shade.min(1.0) / 0.9);
    let cover = (height - COVER_M[0]) / (COVER_M[1] - COVER_M[0]);
    if terrain_light.is_none() { crown } else { mix(ground, crown, cover.clamp(0.0, 0.96)) }
}

fn draw_crowns(figure: &mut Figure<'_>, trees: &[MapTree]) {
    let width = (OUTLINE_M * figure.px_per_m()).clamp(0.7, figure.unit() / 14.0);
    for tree in trees {
        let corners: Vec<[f64; 2]> = tree.crown_m.iter().map(|corner| figure.px(*corner)).collect();
        if extent_px(&corners) >= NARROWEST_CROWN_PX {
            figure.canvas.outline(&corners, width + 0.8, Paint::sheer(INK, 0.22));
            figure.canvas.outline(&corners, width, Paint::sheer(PAPER, 0.6));
        }
    }
}

fn extent_px(corners: &[[f64; 2]]) -> f64 {
    let span = |axis: usize| {
        let values = || corners.iter().map(move |corner| corner[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    span(0).max(span(1))
}

fn draw_tops(figure: &mut Figure<'_>, trees: &[MapTree]) {
    // A dot of 0.4 m where that is visible, and never larger than the legend's.
    let radius = (0.4 * figure.px_per_m()).clamp(1.6, 0.3 * figure.unit());
    for tree in trees {
        let place = figure.px(tree.top_m);
        draw_symbol(&mut figure.canvas, Symbol::Dot(PAPER), place, radius);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pits_are_closed_and_edges_stay() {
        let window = Window { column0: 0, row0: 0, columns: 5, rows: 3 };
        let mut values = vec![20.0_f32; window.len()];
        values[7] = 1.0;
        for row in 0..3 {
            values[row * 5] = 0.0;
        }
        let drawn = without_pits(&Grid { cell_m: 0.5, window, values }, window);
        assert_eq!(drawn.values[7], 20.0);
        assert_eq!([drawn.values[0], drawn.values[5], drawn.values[10]], [0.0, 0.0, 0.0]);
    }
}
