//! Charts of curves in panels side by side, as PNG and as SVG.
//!
//! Axes, grids and curves are laid out by the plotters library; the PNG is painted on a
//! [`Canvas`], with its smooth lines and the fonts that come with the program, so that
//! no font or library of the system is needed and the picture is the same everywhere.
//!
//! ```
//! use timberline_report::chart::{Axis, Chart, Curve, Level, Panel};
//! let panel = Panel {
//!     title: "Dataset I".into(),
//!     x: Axis::new("ω", [0.0, 1.0]),
//!     y: Axis::new("Median error [m]", [0.0, 0.6]),
//!     curves: vec![Curve::new("L1", [0, 114, 178], vec![[0.0, 0.25], [0.5, 0.27]])],
//!     levels: vec![Level::new("highest point", [0, 0, 0], 0.3)],
//! };
//! let chart = Chart { title: "Error".into(), panels: vec![panel], ..Chart::default() };
//! let svg = chart.svg()?;
//! assert!(svg.starts_with("<svg") && svg.contains("Dataset I"));
//! # Ok::<(), timberline_report::Error>(())
//! ```

mod backend;
mod draw;

use crate::canvas::Canvas;
use crate::colour::{PAPER, Rgb};
use crate::text::Fonts;
use crate::{Error, canvas::Paint};
use backend::Pen;
use plotters::prelude::{IntoDrawingArea, SVGBackend};
use std::path::Path;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// Without gaps.
    Solid,
    /// With gaps.
    Dashed,
}

/// What stands at the places of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Nothing.
    None,
    /// A filled disc.
    Disc,
    /// A ring.
    Ring,
}

/// A curve through places given in units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend; curves of one name share an entry.
    pub name: String,
    /// Colour.
    pub colour: Rgb,
    /// Line.
    pub stroke: Stroke,
    /// Marker.
    pub marker: Marker,
    /// Places, x and y, in the order in which they are joined.
    pub places: Vec<[f64; 2]>,
}

impl Curve {
    /// A solid line with discs.
    #[must_use]
    pub fn new(name: &str, colour: Rgb, places: Vec<[f64; 2]>) -> Self {
        Self { name: name.to_owned(), colour, stroke: Stroke::Solid, marker: Marker::Disc, places }
    }

    /// The same curve drawn otherwise.
    #[must_use]
    pub fn drawn(self, stroke: Stroke, marker: Marker) -> Self {
        Self { stroke, marker, ..self }
    }
}

/// A horizontal line across a panel, dashed.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Name in the legend.
    pub name: String,
    /// Colour.
    pub colour: Rgb,
    /// Where, in units of the y axis.
    pub value: f64,
}

impl Level {
    /// A level.
    #[must_use]
    pub fn new(name: &str, colour: Rgb, value: f64) -> Self {
        Self { name: name.to_owned(), colour, value }
    }
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What it shows, with the unit in brackets.
    pub label: String,
    /// Values at its ends.
    pub range: [f64; 2],
    /// Values that are called something else than their number.
    pub names: Vec<(f64, String)>,
    /// Whether all other values go without their number.
    pub names_only: bool,
}

impl Axis {
    /// An axis that shows numbers.
    #[must_use]
    pub fn new(label: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), range, names: Vec::new(), names_only: false }
    }

    /// An axis of named places side by side, at 0, 1, 2 and so on.
    #[must_use]
    pub fn places(label: &str, names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<_> = names.into_iter().enumerate().map(|(i, n)| (i as f64, n)).collect();
        let range = [-0.5, names.len() as f64 - 0.5];
        Self { names, names_only: true, ..Self::new(label, range) }
    }
}

/// One system of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Panel {
    /// Heading.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, the last one on top.
    pub curves: Vec<Curve>,
    /// Horizontal lines, below the curves.
    pub levels: Vec<Level>,
}

/// A page of panels with one legend below them.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Heading; none when empty.
    pub title: String,
    /// Panels row by row from the upper left.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// Width and height of a panel, pixels.
    pub panel_px: [u32; 2],
    /// A line of small print at the foot; none when empty.
    pub note: String,
}

impl Default for Chart {
    fn default() -> Self {
        let (title, note) = (String::new(), String::new());
        Self { title, panels: Vec::new(), columns: 2, panel_px: [1000, 700], note }
    }
}

impl Chart {
    /// The chart as a picture.
    ///
    /// # Errors
    /// [`Error::Empty`] without panels or with an axis without length, [`Error::Font`],
    /// [`Error::Chart`].
    pub fn canvas(&self) -> Result<Canvas, Error> {
        self.check()?;
        let fonts = Fonts::load()?;
        let [width, height] = self.size(&fonts);
        let mut canvas = Canvas::new(width, height, PAPER);
        {
            let root = Pen { canvas: &mut canvas, fonts: &fonts }.into_drawing_area();
            draw::chart(self, &fonts, &root).map_err(chart_error)?;
        }
        Ok(canvas)
    }

    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// As [`Self::canvas`].
    pub fn svg(&self) -> Result<String, Error> {
        self.check()?;
        let fonts = Fonts::load()?;
        let [width, height] = self.size(&fonts);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            let paper = draw::colour(Paint::solid(PAPER).colour);
            root.fill(&paper).map_err(chart_error)?;
            draw::chart(self, &fonts, &root).map_err(chart_error)?;
            root.present().map_err(chart_error)?;
        }
        Ok(text)
    }

    /// Writes the chart as PNG.
    ///
    /// # Errors
    /// As [`Self::canvas`], and [`Error::Write`].
    pub fn write_png(&self, path: &Path) -> Result<(), Error> {
        self.canvas()?.write_png(path)
    }

    fn check(&self) -> Result<(), Error> {
        if self.panels.is_empty() || self.columns == 0 {
            return Err(Error::Empty("the chart has no panels"));
        }
        let sound = |axis: &Axis| {
            axis.range.iter().all(|end| end.is_finite()) && axis.range[0] < axis.range[1]
        };
        if self.panels.iter().all(|panel| sound(&panel.x) && sound(&panel.y)) {
            Ok(())
        } else {
            Err(Error::Empty("an axis of the chart has no length"))
        }
    }

    /// Size of the page, pixels.
    fn size(&self, fonts: &Fonts) -> [u32; 2] {
        let columns = self.columns.min(self.panels.len()) as u32;
        let rows = (self.panels.len() as u32).div_ceil(columns.max(1));
        let width = columns * self.panel_px[0];
        [width, rows * self.panel_px[1] + draw::head_px(self) + draw::foot_px(self, fonts, width)]
    }
}

fn chart_error(error: impl std::fmt::Display) -> Error {
    Error::Chart(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Chart {
        let curve = Curve::new("L1", [200, 0, 0], vec![[0.0, 0.2], [0.5, 0.4], [1.2, 0.3]]);
        let panel = |title: &str| Panel {
            title: title.to_owned(),
            x: Axis { names: vec![(1.2, "none".to_owned())], ..Axis::new("δ [m]", [0.0, 1.2]) },
            y: Axis::new("Error [m]", [0.0, 0.5]),
            curves: vec![curve.clone()],
            levels: vec![Level::new("highest point", [0, 0, 200], 0.25)],
        };
        Chart {
            title: "Errors".to_owned(),
            panels: vec![panel("one"), panel("two"), panel("three")],
            panel_px: [400, 300],
            note: "A note.".to_owned(),
            ..Chart::default()
        }
    }

    #[test]
    fn both_forms_hold_everything() {
        let svg = example().svg().unwrap();
        for text in ["Errors", "one", "two", "three", "none", "δ [m]", "Error [m]", "A note."] {
            assert!(svg.contains(text), "{text}");
        }
        // One entry of the legend for the curves of three panels.
        assert_eq!(svg.matches("highest point").count(), 1);
        let canvas = example().canvas().unwrap();
        let size = format!("width=\"{}\" height=\"{}\"", canvas.width(), canvas.height());
        assert!(svg.contains(&size), "{size}");
        let count = |wanted: Rgb| {
            let all = (0..i64::from(canvas.height()))
                .flat_map(|y| (0..i64::from(canvas.width())).map(move |x| (x, y)));
            all.filter(|&(x, y)| canvas.pixel(x, y) == Some(wanted)).count()
        };
        assert!(count([200, 0, 0]) > 500 && count([0, 0, 200]) > 200);
    }

    #[test]
    fn places_have_names_and_no_numbers() {
        let mut chart = example();
        chart.panels.truncate(1);
        chart.panels[0].x = Axis::places("Layer", ["upper", "lower"].map(str::to_owned));
        let svg = chart.svg().unwrap();
        assert!(svg.contains("upper") && svg.contains("lower"));
        assert!(!svg.contains("\n-0.5\n"), "{svg}");
    }

    #[test]
    fn the_same_chart_is_the_same_picture() {
        assert_eq!(example().canvas().unwrap(), example().canvas().unwrap());
        assert_eq!(example().svg().unwrap(), example().svg().unwrap());
    }

    #[test]
    fn charts_of_nothing_are_refused() {
        assert!(Chart::default().svg().is_err());
        let mut chart = example();
        chart.panels[1].y.range = [1.0, 1.0];
        assert!(chart.canvas().unwrap_err().to_string().contains("no length"));
    }
}
