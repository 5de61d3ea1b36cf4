//! The layout of a chart, the same for every form of picture.

use super::{Axis, Chart, Curve, Level, Marker, Panel, Stroke};
use crate::canvas::Paint;
use crate::colour::{GREY, INK, Rgb};
use crate::text::{Fonts, Style};
use crate::ticks::decimals;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Heights of text, pixels: titles, labels of axes, numbers and legend, small print.
const TITLE_PX: f64 = 44.0;
const LABEL_PX: f64 = 34.0;
const NUMBER_PX: f64 = 30.0;
const SMALL_PX: f64 = 25.0;
/// Widths of lines, pixels.
const CURVE_PX: u32 = 4;
const LEVEL_PX: u32 = 3;
/// Radius of markers, pixels.
const MARKER_PX: i32 = 7;
/// Length of dashes and of the gaps between them, pixels.
const DASH_PX: u32 = 16;
const GAP_PX: u32 = 10;
/// Length of the sample of a line in the legend, and the room around an entry, pixels.
const SAMPLE_PX: i32 = 70;
const ROOM_PX: i32 = 44;
/// Height of a line of the legend, pixels.
const LEGEND_LINE_PX: i32 = 46;
/// Room left and right of legend and title, pixels.
const SIDE_PX: i32 = 40;
/// Font named in SVG files.
const FAMILY: &str = "DejaVu Sans, Verdana, sans-serif";

type Failure<B> = DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>;
type Area<B> = DrawingArea<B, Shift>;
type Plane<'a, B> = ChartContext<'a, B, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A colour in plotters' terms.
pub(super) fn colour([red, green, blue]: Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

fn font(size: f64, ink: Rgb) -> TextStyle<'static> {
    styled((FAMILY, size).into_font(), ink)
}

fn bold(size: f64) -> TextStyle<'static> {
    styled((FAMILY, size, FontStyle::Bold).into_font(), INK)
}

fn styled(font: FontDesc<'static>, ink: Rgb) -> TextStyle<'static> {
    TextStyle { color: colour(ink).to_backend_color(), ..TextStyle::from(font) }
}

/// Height of the title, pixels.
pub(super) fn head_px(chart: &Chart) -> u32 {
    if chart.title.is_empty() { 0 } else { (1.9 * TITLE_PX) as u32 }
}

/// Height of the legend and the small print, pixels.
pub(super) fn foot_px(chart: &Chart, fonts: &Fonts, width: u32) -> u32 {
    let lines = legend(chart, fonts, width as i32).last().map_or(0, |entry| entry.line + 1);
    let note = if chart.note.is_empty() { 0.0 } else { 1.8 * SMALL_PX };
    (lines * LEGEND_LINE_PX) as u32 + note as u32 + 24
}

/// Draws everything.
pub(super) fn chart<B: DrawingBackend>(
    chart: &Chart,
    fonts: &Fonts,
    root: &Area<B>,
) -> Result<(), Failure<B>> {
    let (width, height) = root.dim_in_pixel();
    let (head, foot) = (head_px(chart), foot_px(chart, fonts, width));
    let (top, rest) = root.split_vertically(head);
    let (middle, bottom) = rest.split_vertically(height - head - foot);
    if !chart.title.is_empty() {
        let style = bold(TITLE_PX).pos(Pos::new(HPos::Center, VPos::Center));
        top.draw(&Text::new(chart.title.clone(), (width as i32 / 2, head as i32 / 2 + 8), style))?;
    }
    let columns = chart.columns.min(chart.panels.len());
    let areas = middle.split_evenly((chart.panels.len().div_ceil(columns), columns));
    for (own, area) in chart.panels.iter().zip(&areas) {
        panel(own, area)?;
    }
    draw_legend(chart, fonts, &bottom)
}

fn panel<B: DrawingBackend>(panel: &Panel, area: &Area<B>) -> Result<(), Failure<B>> {
    let (x, y) = (&panel.x, &panel.y);
    let mut plane = ChartBuilder::on(area)
        .caption(&panel.title, bold(LABEL_PX + 2.0))
        .margin(20)
        .margin_right(56)
        .x_label_area_size(94)
        .y_label_area_size(124)
        .build_cartesian_2d(x.range[0]..x.range[1], y.range[0]..y.range[1])?;
    mesh(panel, &mut plane)?;
    for level in &panel.levels {
        let ends = x.range.map(|x| (x, within(y, level.value)));
        dashed(&mut plane, &ends, level.colour, LEVEL_PX)?;
    }
    panel.curves.iter().try_for_each(|curve| draw_curve(panel, curve, &mut plane))
}

fn mesh<B: DrawingBackend>(panel: &Panel, plane: &mut Plane<'_, B>) -> Result<(), Failure<B>> {
    plane
        .configure_mesh()
        .x_desc(&panel.x.label)
        .y_desc(&panel.y.label)
        .axis_desc_style(font(LABEL_PX, INK))
        .label_style(font(NUMBER_PX, INK))
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&|value| number(&panel.x, *value))
        .y_label_formatter(&|value| number(&panel.y, *value))
        .max_light_lines(0)
        .bold_line_style(colour([225, 228, 231]).stroke_width(2))
        .axis_style(colour(GREY).stroke_width(2))
        .draw()
}

/// A value on an axis.
fn number(axis: &Axis, value: f64) -> String {
    let near = |(own, _): &&(f64, String)| (own - value).abs() < 1e-9;
    let plain = || match axis.names_only {
        true => String::new(),
        false => format!("{:.*}", decimals(value.abs()).max(1), value),
    };
    axis.names.iter().find(near).map_or_else(plain, |(_, name)| name.clone())
}

/// A value moved to the nearest end of the axis if it lies beyond.
fn within(axis: &Axis, value: f64) -> f64 {
    value.clamp(axis.range[0], axis.range[1])
}

fn draw_curve<B: DrawingBackend>(
    panel: &Panel,
    curve: &Curve,
    plane: &mut Plane<'_, B>,
) -> Result<(), Failure<B>> {
    let finite = curve.places.iter().filter(|place| place.iter().all(|value| value.is_finite()));
    let places: Vec<(f64, f64)> =
        finite.map(|&[x, y]| (within(&panel.x, x), within(&panel.y, y))).collect();
    let ink = colour(curve.colour);
    match curve.stroke {
        Stroke::Solid => {
            plane.draw_series(LineSeries::new(places.clone(), ink.stroke_width(CURVE_PX)))?;
        }
        Stroke::Dashed => dashed(plane, &places, curve.colour, CURVE_PX)?,
    }
    let style = marker_style(curve.marker, curve.colour);
    if let Some(style) = style {
        plane.draw_series(places.iter().map(|&at| Circle::new(at, MARKER_PX, style)))?;
    }
    Ok(())
}

fn marker_style(marker: Marker, ink: Rgb) -> Option<ShapeStyle> {
    match marker {
        Marker::None => None,
        Marker::Disc => Some(colour(ink).filled()),
        Marker::Ring => Some(colour(ink).stroke_width(3)),
    }
}

fn dashed<B: DrawingBackend>(
    plane: &mut Plane<'_, B>,
    places: &[(f64, f64)],
    ink: Rgb,
    width: u32,
) -> Result<(), Failure<B>> {
    let style = colour(ink).stroke_width(width);
    plane.draw_series(DashedLineSeries::new(places.to_vec(), DASH_PX, GAP_PX, style))?;
    Ok(())
}

/// An entry of the legend and where it stands.
struct Entry<'a> {
    name: &'a str,
    colour: Rgb,
    stroke: Stroke,
    marker: Marker,
    line: i32,
    left: i32,
}

/// The entries in the order of their first appearance, in lines as wide as the page.
fn legend<'a>(chart: &'a Chart, fonts: &Fonts, width: i32) -> Vec<Entry<'a>> {
    let mut entries: Vec<Entry<'a>> = Vec::new();
    let mut add = |name: &'a str, colour: Rgb, stroke: Stroke, marker: Marker| {
        if entries.iter().all(|entry| entry.name != name) {
            entries.push(Entry { name, colour, stroke, marker, line: 0, left: 0 });
        }
    };
    for panel in &chart.panels {
        for Curve { name, colour, stroke, marker, .. } in &panel.curves {
            add(name, *colour, *stroke, *marker);
        }
    }
    for Level { name, colour, .. } in chart.panels.iter().flat_map(|panel| &panel.levels) {
        add(name, *colour, Stroke::Dashed, Marker::None);
    }
    let style = Style::new(NUMBER_PX, Paint::solid(INK));
    let (mut line, mut left) = (0, SIDE_PX);
    for entry in &mut entries {
        let own = SAMPLE_PX + 14 + fonts.width(entry.name, &style).ceil() as i32;
        if left > SIDE_PX && left + own > width - SIDE_PX {
            (line, left) = (line + 1, SIDE_PX);
        }
        (entry.line, entry.left) = (line, left);
        left += own + ROOM_PX;
    }
    entries
}

fn draw_legend<B: DrawingBackend>(
    chart: &Chart,
    fonts: &Fonts,
    area: &Area<B>,
) -> Result<(), Failure<B>> {
    let (width, height) = area.dim_in_pixel();
    for entry in legend(chart, fonts, width as i32) {
        let y = entry.line * LEGEND_LINE_PX + LEGEND_LINE_PX / 2;
        sample(&entry, y, area)?;
        let style = font(NUMBER_PX, INK).pos(Pos::new(HPos::Left, VPos::Center));
        let place = (entry.left + SAMPLE_PX + 14, y);
        area.draw(&Text::new(entry.name.to_owned(), place, style))?;
    }
    if !chart.note.is_empty() {
        let style = font(SMALL_PX, GREY).pos(Pos::new(HPos::Left, VPos::Center));
        let place = (SIDE_PX, height as i32 - (1.3 * SMALL_PX) as i32);
        area.draw(&Text::new(chart.note.clone(), place, style))?;
    }
    Ok(())
}

/// The sample of a line in the legend.
fn sample<B: DrawingBackend>(entry: &Entry<'_>, y: i32, area: &Area<B>) -> Result<(), Failure<B>> {
    let (left, right) = (entry.left, entry.left + SAMPLE_PX);
    let style = colour(entry.colour).stroke_width(CURVE_PX);
    let step = match entry.stroke {
        Stroke::Solid => SAMPLE_PX,
        Stroke::Dashed => (DASH_PX + GAP_PX) as i32,
    };
    let mut from = left;
    while from < right {
        let to = match entry.stroke {
            Stroke::Solid => right,
            Stroke::Dashed => (from + DASH_PX as i32).min(right),
        };
        area.draw(&PathElement::new(vec![(from, y), (to, y)], style))?;
        from += step;
    }
    if let Some(style) = marker_style(entry.marker, entry.colour) {
        area.draw(&Circle::new(((left + right) / 2, y), MARKER_PX, style))?;
    }
    Ok(())
}
