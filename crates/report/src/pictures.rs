//! Pictures of single artefacts, for looking into a store.

use crate::canvas::Canvas;
use crate::colour::{self, CIVIDIS, INK, NO_DATA, Ramp, Rgb, VIRIDIS, lit};
use crate::figure::{Entry, Figure, Page, Symbol, draw_symbol};
use crate::grid::range;
use crate::hillshade::hillshade;
use crate::{Error, Grid};
use std::collections::BTreeMap;
use timberline_artefact::Crs;
use timberline_artefact::kinds::{CrownModel, CrownStatus, Treetop};
use timberline_pointcloud::{PointCloud, Rect};

/// Share of values beyond either end of a ramp.
const LEFT_OUT: f64 = 0.005;

/// Heading of a picture and the CRS of its coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading<'a> {
    /// Title.
    pub title: &'a str,
    /// A line below it.
    pub subtitle: &'a str,
    /// The CRS.
    pub crs: &'a Crs,
}

impl<'a> Heading<'a> {
    fn page(&self, extent: Rect, detail_m: f64, legend: Vec<Entry>) -> Page<'a> {
        let Self { title, subtitle, crs } = *self;
        // A single point has no extent: show a metre around it.
        let margin = (extent.size()[0].max(extent.size()[1]) * 0.02).max(0.5);
        Page { title, subtitle, extent: extent.grown(margin), detail_m, crs, legend }
    }
}

/// A raster, coloured by value and shaded as a surface.
///
/// `meaning` stands in the legend, with the unit: `Elevation [m]`.
///
/// # Errors
/// [`Error::Empty`] without values, [`Error::Font`].
pub fn raster(heading: &Heading<'_>, grid: &Grid, meaning: &str) -> Result<Canvas, Error> {
    let [low, high] =
        widened(grid.range(LEFT_OUT).ok_or(Error::Empty("the raster has no values"))?);
    let legend = vec![ramp_entry(meaning, CIVIDIS, [low, high]), no_data_entry()];
    let window = grid.window;
    let edge = |index: i64| index as f64 * grid.cell_m;
    let extent = Rect {
        min: [edge(window.column0), edge(window.row0)],
        max: [edge(window.end_column()), edge(window.end_row())],
    };
    let light = hillshade(grid, 1.0, window);
    let mut figure = Figure::new(heading.page(extent, grid.cell_m, legend))?;
    let colour = |at| {
        let Some(value) = grid.sample(at) else { return NO_DATA };
        let shade = 0.3 + 1.4 * light.sample(at).unwrap_or(0.5);
        lit(CIVIDIS.at((value - low) / (high - low)), shade)
    };
    figure.paint(|_| colour);
    Ok(figure.finish())
}

/// By what points are coloured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PointColour<'a> {
    /// A value of every point (NaN: grey), with its meaning and unit.
    Value(&'a [f32], &'a str),
    /// The ASPRS class.
    Class,
    /// A tree id of every point, 0 (grey) for none.
    Tree(&'a [u64]),
}

/// Points from above, the highest on top.
///
/// # Errors
/// [`Error::Empty`] without points, [`Error::Font`].
pub fn points(
    heading: &Heading<'_>,
    cloud: &PointCloud,
    by: PointColour<'_>,
) -> Result<Canvas, Error> {
    let extent = bounds((0..cloud.len()).map(|i| [cloud.world(i)[0], cloud.world(i)[1]]))
        .ok_or(Error::Empty("there are no points"))?;
    let scale = Scale::of(cloud, by);
    let [width, height] = extent.size();
    let spacing = (width.max(1.0) * height.max(1.0) / cloud.len() as f64).sqrt();
    let mut figure = Figure::new(heading.page(extent, spacing, scale.legend(cloud)))?;
    figure.clear();
    let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
    order.sort_by(|a, b| cloud.z[*a as usize].total_cmp(&cloud.z[*b as usize]).then(a.cmp(b)));
    let radius = (0.55 * spacing * figure.px_per_m()).clamp(0.8, 0.3 * figure.unit());
    for index in order {
        let [x, y, _] = cloud.world(index as usize);
        let place = figure.px([x, y]);
        let paint = crate::canvas::Paint::solid(scale.colour(cloud, index as usize));
        figure.canvas.disc(place, radius, paint);
    }
    Ok(figure.finish())
}

/// How points become colours.
struct Scale<'a> {
    by: PointColour<'a>,
    range: [f64; 2],
}

impl<'a> Scale<'a> {
    fn of(cloud: &PointCloud, by: PointColour<'a>) -> Self {
        let values = if let PointColour::Value(values, _) = by { values } else { &[] };
        let shown = values.iter().copied().take(cloud.len());
        Self { by, range: widened(range(shown, LEFT_OUT).unwrap_or([0.0, 1.0])) }
    }

    fn colour(&self, cloud: &PointCloud, index: usize) -> Rgb {
        match self.by {
            PointColour::Value(values, _) => {
                let value = values.get(index).map_or(f64::NAN, |value| f64::from(*value));
                let place = (value - self.range[0]) / (self.range[1] - self.range[0]);
                if value.is_nan() { colour::GREY } else { VIRIDIS.at(place) }
            }
            PointColour::Class => colour::class(cloud.classification[index]).0,
            PointColour::Tree(ids) => match ids.get(index) {
                None | Some(0) => [200, 203, 206],
                Some(id) => colour::of_id(*id),
            },
        }
    }

    fn legend(&self, cloud: &PointCloud) -> Vec<Entry> {
        match self.by {
            PointColour::Value(_, meaning) => vec![ramp_entry(meaning, VIRIDIS, self.range)],
            PointColour::Class => {
                let mut counts = BTreeMap::new();
                for code in &cloud.classification {
                    *counts.entry(*code).or_insert(0_u64) += 1;
                }
                let all = cloud.len() as f64;
                let entry = |(code, count): (u8, u64)| {
                    let (rgb, name) = colour::class(code);
                    let share = count as f64 / all * 100.0;
                    let share =
                        if share < 0.1 { "< 0.1".to_owned() } else { format!("{share:.1}") };
                    Entry::Symbol(Symbol::Swatch(rgb), format!("{code} {name}, {share} %"))
                };
                counts.into_iter().map(entry).collect()
            }
            PointColour::Tree(ids) => {
                let mut trees: Vec<u64> = ids.iter().copied().filter(|id| *id != 0).collect();
                trees.sort_unstable();
                trees.dedup();
                let text = format!("{} trees", trees.len());
                vec![
                    Entry::Symbol(Symbol::Swatch(colour::of_id(1)), text),
                    Entry::Symbol(Symbol::Swatch([200, 203, 206]), "no tree".to_owned()),
                    Entry::Note("colours only tell neighbours apart".to_owned()),
                ]
            }
        }
    }
}

/// Treetops as dots coloured by height.
///
/// # Errors
/// [`Error::Empty`] without treetops, [`Error::Font`].
pub fn treetops(heading: &Heading<'_>, tops: &[Treetop]) -> Result<Canvas, Error> {
    let extent = bounds(tops.iter().map(|top| [top.apex_m[0], top.apex_m[1]]))
        .ok_or(Error::Empty("there are no treetops"))?;
    let heights = tops.iter().map(|top| top.height_m as f32);
    let [low, high] = widened(range(heights, 0.0).unwrap_or([0.0, 1.0]));
    let legend = vec![ramp_entry("Tree height [m]", VIRIDIS, [low, high])];
    let mut figure = Figure::new(heading.page(extent, 0.5, legend))?;
    figure.clear();
    let radius = (0.8 * figure.px_per_m()).clamp(2.0, 0.4 * figure.unit());
    for top in tops {
        let place = figure.px([top.apex_m[0], top.apex_m[1]]);
        let colour = VIRIDIS.at((top.height_m - low) / (high - low));
        draw_symbol(&mut figure.canvas, Symbol::Dot(colour), place, radius);
    }
    Ok(figure.finish())
}

/// Crown models as circles of their radius coloured by height; rejected ones as crosses.
///
/// # Errors
/// [`Error::Empty`] without models, [`Error::Font`].
pub fn crown_models(heading: &Heading<'_>, models: &[CrownModel]) -> Result<Canvas, Error> {
    let extent = bounds(models.iter().map(|model| [model.apex_m[0], model.apex_m[1]]))
        .ok_or(Error::Empty("there are no crown models"))?;
    let heights = models.iter().map(|model| model.height_m as f32);
    let [low, high] = widened(range(heights, 0.0).unwrap_or([0.0, 1.0]));
    const REJECTED: Rgb = [213, 94, 0];
    let accepted = models.iter().filter(|m| m.status == CrownStatus::Accepted).count();
    let rejected = models.len() - accepted;
    let legend = vec![
        ramp_entry("Tree height [m]", VIRIDIS, [low, high]),
        Entry::Symbol(Symbol::Ring(INK), format!("{accepted} crown models")),
        Entry::Symbol(Symbol::Cross(REJECTED), format!("{rejected} rejected")),
    ];
    let mut figure = Figure::new(heading.page(extent.grown(3.0), 0.5, legend))?;
    figure.clear();
    for model in models {
        let place = figure.px([model.apex_m[0], model.apex_m[1]]);
        let colour = VIRIDIS.at((model.height_m - low) / (high - low));
        if model.status == CrownStatus::Accepted {
            let radius = model.radius_m * figure.px_per_m();
            figure.canvas.disc(place, radius, crate::canvas::Paint::sheer(colour, 0.45));
            ring(&mut figure.canvas, place, radius, colour);
        } else {
            let radius = 0.35 * figure.unit();
            draw_symbol(&mut figure.canvas, Symbol::Cross(REJECTED), place, radius);
        }
    }
    Ok(figure.finish())
}

/// A circle with a line of 2 pixels.
fn ring(canvas: &mut Canvas, [x, y]: [f64; 2], radius: f64, colour: Rgb) {
    let corner = |i: u32| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 64.0);
        [x + radius * cosine, y + radius * sine]
    };
    let corners: Vec<[f64; 2]> = (0..64).map(corner).collect();
    canvas.outline(&corners, 2.0, crate::canvas::Paint::solid(lit(colour, 0.75)));
}

fn ramp_entry(meaning: &str, ramp: Ramp, range: [f64; 2]) -> Entry {
    Entry::Ramp { title: meaning.to_owned(), ramp, range }
}

fn no_data_entry() -> Entry {
    Entry::Symbol(Symbol::Swatch(NO_DATA), "no data".to_owned())
}

/// A range that is not a single value.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    if high - low > 1e-6 { [low, high] } else { [low - 0.5, high + 0.5] }
}

fn bounds(points: impl Iterator<Item = [f64; 2]>) -> Option<Rect> {
    points.map(|point| Rect { min: point, max: point }).reduce(|a, b| a.union(&b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::{Frame, Point};

    const HEADING: fn(&Crs) -> Heading<'_> = |crs| Heading { title: "a", subtitle: "b", crs };

    #[test]
    fn one_thing_alone_can_be_drawn() {
        let crs = Crs::default();
        let mut cloud = PointCloud::new(Frame::default());
        cloud.push_world([5.0, 6.0, 7.0], &Point::default());
        for by in
            [PointColour::Class, PointColour::Tree(&[9]), PointColour::Value(&[f32::NAN], "x")]
        {
            assert!(points(&HEADING(&crs), &cloud, by).unwrap().width() < 4000);
        }
        treetops(&HEADING(&crs), &[Treetop::default()]).unwrap();
        crown_models(&HEADING(&crs), &[CrownModel::default()]).unwrap();
    }

    #[test]
    fn nothing_is_an_error() {
        let crs = Crs::default();
        let cloud = PointCloud::new(Frame::default());
        assert!(points(&HEADING(&crs), &cloud, PointColour::Class).is_err());
        assert!(treetops(&HEADING(&crs), &[]).unwrap_err().to_string().contains("no treetops"));
    }
}
