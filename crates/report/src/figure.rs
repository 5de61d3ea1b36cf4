//! The page around a map: title, frame with coordinates, legend, scale bar, north arrow.

use crate::Error;
use crate::canvas::{Canvas, Paint};
use crate::colour::{GREY, INK, NO_DATA, PAPER, Ramp, Rgb};
use crate::text::{Align, Fonts, Style, grouped};
use crate::ticks::{decimals, round_below, ticks};
use rayon::prelude::*;
use timberline_artefact::Crs;
use timberline_pointcloud::Rect;

/// Longest edge of the map itself, pixels: with margins and legend a page stays below 4000.
pub const LONGEST_PX: f64 = 3200.0;
/// What a small map is enlarged to.
const SHORTEST_PX: f64 = 1400.0;
/// Rows of pixels that are painted together.
const BAND_PX: usize = 64;
/// Width of the legend and least height of a page, in text heights.
const LEGEND_WIDTH: f64 = 13.5;
const LEGEND_HEIGHT: f64 = 25.0;

/// A symbol in the legend, as on the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Symbol {
    /// A dot with a rim.
    Dot(Rgb),
    /// A ring.
    Ring(Rgb),
    /// A cross.
    Cross(Rgb),
    /// A filled square.
    Swatch(Rgb),
    /// A filled square with a light ring: a crown outline on a canopy.
    Crown(Rgb),
}

/// One part of the legend.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A ramp with its values.
    Ramp {
        /// What the colour means, with the unit.
        title: String,
        /// The colours.
        ramp: Ramp,
        /// Values at the ends.
        range: [f64; 2],
    },
    /// A symbol and what it means.
    Symbol(Symbol, String),
    /// Small print.
    Note(String),
}

/// What stands on a page besides the map.
#[derive(Debug, Clone, PartialEq)]
pub struct Page<'a> {
    /// Heading.
    pub title: &'a str,
    /// A line below it.
    pub subtitle: &'a str,
    /// The area of the map, metres.
    pub extent: Rect,
    /// Edge of what is drawn in one colour, metres: small maps are enlarged until it shows.
    pub detail_m: f64,
    /// For the coordinates along the frame; without one they are metres.
    pub crs: &'a Crs,
    /// The legend.
    pub legend: Vec<Entry>,
}

/// A page being drawn.
#[derive(Debug, Clone)]
pub struct Figure<'a> {
    /// The picture.
    pub canvas: Canvas,
    /// The fonts.
    pub fonts: Fonts,
    page: Page<'a>,
    /// Height of text, pixels.
    unit: f64,
    px_per_m: f64,
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl<'a> Figure<'a> {
    /// An empty page.
    ///
    /// # Errors
    /// [`Error::Empty`] for an extent without area, [`Error::Font`].
    pub fn new(page: Page<'a>) -> Result<Self, Error> {
        let [width_m, height_m] = page.extent.size();
        let longest_m = width_m.max(height_m);
        if !(longest_m.is_finite() && width_m > 0.0 && height_m > 0.0) {
            return Err(Error::Empty("the extent of the map has no area"));
        }
        let longest = (longest_m / page.detail_m * 2.0).clamp(SHORTEST_PX, LONGEST_PX);
        let px_per_m = longest / longest_m;
        let (width, height) = ((width_m * px_per_m).ceil(), (height_m * px_per_m).ceil());
        // Text in proportion to the map's area: narrow maps are not crowded by it.
        let unit = ((width * height).sqrt() / 58.0).max(22.0).round();
        let (left, top) = (6.2 * unit, 4.6 * unit);
        let page_width = left + width.max(14.0 * unit) + LEGEND_WIDTH * unit;
        let page_height = top + height.max(LEGEND_HEIGHT * unit) + 3.0 * unit;
        let canvas = Canvas::new(page_width as u32, page_height as u32, PAPER);
        let fonts = Fonts::load()?;
        Ok(Self { canvas, fonts, page, unit, px_per_m, left, top, width, height })
    }

    /// Pixels in a metre.
    #[must_use]
    pub fn px_per_m(&self) -> f64 {
        self.px_per_m
    }

    /// Height of text, pixels: the measure for symbols.
    #[must_use]
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// Where a world position is on the page.
    #[must_use]
    pub fn px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let extent = self.page.extent;
        [
            self.left + (x - extent.min[0]) * self.px_per_m,
            self.top + self.height - (y - extent.min[1]) * self.px_per_m,
        ]
    }

    /// Paints the map pixel by pixel in bands, side by side: `prepare` gets the world's y at the
    /// southern and northern row of a band and returns what tells the colour of a position between.
    pub fn paint<C: Fn([f64; 2]) -> Rgb>(&mut self, prepare: impl Fn([f64; 2]) -> C + Sync) {
        let (corner, scale, height) = (self.page.extent.min, self.px_per_m, self.height);
        let (left, columns, rows) = (self.left as usize, self.width as usize, height as usize);
        let x = |column: usize| corner[0] + (column as f64 + 0.5) / scale;
        let y = |row: usize| corner[1] + (height - row as f64 - 0.5) / scale;
        let width = self.canvas.width() as usize;
        self.canvas.bands(self.top as usize, rows, BAND_PX).enumerate().for_each(
            |(band, pixels)| {
                let first = band * BAND_PX;
                let colour = prepare([y(first + pixels.len() / width - 1), y(first)]);
                for (row, pixels) in pixels.chunks_mut(width).enumerate() {
                    let y = y(first + row);
                    let pixels = pixels[left..left + columns].iter_mut().enumerate();
                    pixels.for_each(|(column, pixel)| *pixel = colour([x(column), y]));
                }
            },
        );
    }

    /// Fills the map with the colour of missing data.
    pub fn clear(&mut self) {
        self.paint(|_| |_| NO_DATA);
    }

    /// Adds everything around the map and returns the picture. What was drawn beyond the frame
    /// disappears.
    #[must_use]
    pub fn finish(mut self) -> Canvas {
        self.trim();
        self.frame();
        self.heading();
        let legend = std::mem::take(&mut self.page.legend);
        self.legend(&legend);
        self.north_arrow();
        self.scale_bar();
        self.canvas
    }

    fn trim(&mut self) {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let (end_x, end_y) = (f64::from(self.canvas.width()), f64::from(self.canvas.height()));
        let paper = Paint::solid(PAPER);
        self.canvas.rect([0.0, 0.0], [end_x, self.top], paper);
        self.canvas.rect([0.0, bottom], [end_x, end_y], paper);
        self.canvas.rect([0.0, 0.0], [self.left, end_y], paper);
        self.canvas.rect([right, 0.0], [end_x, end_y], paper);
    }

    fn frame(&mut self) {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        let corners =
            [[self.left, self.top], [right, self.top], [right, bottom], [self.left, bottom]];
        let ink = Paint::solid(GREY);
        self.canvas.outline(&corners, self.hairline(), ink);
        let small = Style::new(0.78 * self.unit, Paint::solid(GREY));
        let per_unit = self.page.crs.horizontal_m_per_unit;
        let range = |axis: usize| {
            (self.page.extent.min[axis] / per_unit, self.page.extent.max[axis] / per_unit)
        };
        let ((west, east), (south, north)) = (range(0), range(1));
        let count = |pixels: f64, room: f64| pixels / (room * self.unit);
        let tick = 0.35 * self.unit;
        for value in ticks(west, east, count(self.width, 8.0)) {
            let [x, _] = self.px([value * per_unit, self.page.extent.min[1]]);
            self.canvas.line(&[[x, bottom], [x, bottom + tick]], self.hairline(), ink);
            let place = [x, bottom + tick + 0.9 * self.unit];
            let text = coordinate(value);
            self.fonts.write(&mut self.canvas, &text, place, &small.align(Align::Centre));
        }
        for value in ticks(south, north, count(self.height, 6.0)) {
            let [_, y] = self.px([self.page.extent.min[0], value * per_unit]);
            self.canvas.line(&[[self.left - tick, y], [self.left, y]], self.hairline(), ink);
            let place = [self.left - 1.6 * tick, y + 0.27 * self.unit];
            let text = coordinate(value);
            self.fonts.write(&mut self.canvas, &text, place, &small.align(Align::Right));
        }
    }

    fn hairline(&self) -> f64 {
        (self.unit / 14.0).max(1.0)
    }

    fn heading(&mut self) {
        let room = f64::from(self.canvas.width()) - self.left - self.unit;
        let title = Style::new(1.75 * self.unit, Paint::solid(INK)).bold();
        let title = self.fitted(self.page.title, title, room);
        let place = [self.left, 1.95 * self.unit];
        self.fonts.write(&mut self.canvas, self.page.title, place, &title);
        let subtitle = Style::new(self.unit, Paint::solid(GREY));
        let subtitle = self.fitted(self.page.subtitle, subtitle, room);
        let place = [self.left, 3.6 * self.unit];
        self.fonts.write(&mut self.canvas, self.page.subtitle, place, &subtitle);
    }

    /// A style, smaller if the text would not fit into the room.
    fn fitted(&self, text: &str, style: Style, room: f64) -> Style {
        let width = self.fonts.width(text, &style);
        let shrink = if width > room { room / width } else { 1.0 };
        Style { size: style.size * shrink, ..style }
    }

    fn legend_left(&self) -> f64 {
        f64::from(self.canvas.width()) - (LEGEND_WIDTH - 1.5) * self.unit
    }

    fn legend(&mut self, entries: &[Entry]) {
        let mut y = self.top;
        for entry in entries {
            y = match entry {
                Entry::Ramp { title, ramp, range } => self.ramp(y, title, *ramp, *range),
                Entry::Symbol(symbol, text) => self.symbol(y, *symbol, text),
                Entry::Note(text) => self.note(y, text),
            };
        }
    }

    fn ramp(&mut self, y: f64, title: &str, ramp: Ramp, [low, high]: [f64; 2]) -> f64 {
        let (left, unit) = (self.legend_left(), self.unit);
        let style = Style::new(unit, Paint::solid(INK));
        let bold = self.fitted(title, style.bold(), (LEGEND_WIDTH - 2.0) * unit);
        self.fonts.write(&mut self.canvas, title, [left, y + 0.8 * unit], &bold);
        let (top, length, width) = (y + 1.7 * unit, 9.0 * unit, 1.5 * unit);
        for row in 0..length as i64 {
            let colour = ramp.at(1.0 - (row as f64 + 0.5) / length);
            let at = top + row as f64;
            self.canvas.rect([left, at], [left + width, at + 1.0], Paint::solid(colour));
        }
        let marks = ticks(low, high, 6.0);
        let step = if marks.len() > 1 { marks[1] - marks[0] } else { 1.0 };
        for value in marks {
            let at = top + length * (1.0 - (value - low) / (high - low).max(1e-9));
            let ends = [[left + width, at], [left + width + 0.35 * unit, at]];
            self.canvas.line(&ends, self.hairline(), Paint::solid(GREY));
            let text = format!("{value:.*}", decimals(step));
            let place = [left + width + 0.7 * unit, at + 0.34 * unit];
            self.fonts.write(&mut self.canvas, &text, place, &style);
        }
        top + length + 1.4 * unit
    }

    fn symbol(&mut self, y: f64, symbol: Symbol, text: &str) -> f64 {
        let (left, unit) = (self.legend_left(), self.unit);
        let centre = [left + 0.75 * unit, y + 0.5 * unit];
        draw_symbol(&mut self.canvas, symbol, centre, 0.42 * unit);
        let style = Style::new(unit, Paint::solid(INK));
        let style = self.fitted(text, style, (LEGEND_WIDTH - 4.0) * unit);
        self.fonts.write(&mut self.canvas, text, [left + 2.0 * unit, y + 0.84 * unit], &style);
        y + 1.55 * unit
    }

    fn note(&mut self, y: f64, text: &str) -> f64 {
        let style = Style::new(0.78 * self.unit, Paint::solid(GREY));
        let style = self.fitted(text, style, (LEGEND_WIDTH - 2.0) * self.unit);
        let place = [self.legend_left(), y + 0.7 * self.unit];
        self.fonts.write(&mut self.canvas, text, place, &style);
        y + 1.2 * self.unit
    }

    /// Bottom of the legend's column.
    fn foot(&self) -> f64 {
        f64::from(self.canvas.height()) - 3.0 * self.unit
    }

    fn north_arrow(&mut self) {
        let unit = self.unit;
        let (x, y) = (self.legend_left() + 0.9 * unit, self.foot() - 3.4 * unit);
        let ink = Paint::solid(INK);
        let tip = [x, y - 2.6 * unit];
        let west = [tip, [x - 0.75 * unit, y], [x, y - 0.55 * unit]];
        let east = [tip, [x + 0.75 * unit, y], [x, y - 0.55 * unit]];
        self.canvas.polygon(&west, ink);
        self.canvas.outline(&west, self.hairline(), ink);
        self.canvas.outline(&east, self.hairline(), ink);
        let style = Style::new(1.1 * unit, ink).bold().align(Align::Centre);
        self.fonts.write(&mut self.canvas, "N", [x, y - 3.0 * unit], &style);
    }

    fn scale_bar(&mut self) {
        let unit = self.unit;
        let room_m = (LEGEND_WIDTH - 4.5) * unit / self.px_per_m;
        let length_m = round_below(room_m);
        let (left, length) = (self.legend_left(), length_m * self.px_per_m);
        let (top, thick) = (self.foot() - 1.1 * unit, 0.42 * unit);
        for quarter in 0..4 {
            let from = left + length * f64::from(quarter) / 4.0;
            let to = left + length * f64::from(quarter + 1) / 4.0;
            let colour = if quarter % 2 == 0 { INK } else { PAPER };
            self.canvas.rect([from, top], [to, top + thick], Paint::solid(colour));
        }
        let right = left + length;
        let corners = [[left, top], [right, top], [right, top + thick], [left, top + thick]];
        self.canvas.outline(&corners, self.hairline(), Paint::solid(INK));
        let style = Style::new(0.85 * unit, Paint::solid(INK));
        let (number, name) =
            if length_m >= 1000.0 { (length_m / 1000.0, "km") } else { (length_m, "m") };
        let text = format!("{number:.*} {name}", decimals(number));
        let below = top + thick + 0.95 * unit;
        self.fonts.write(&mut self.canvas, "0", [left, below], &style.align(Align::Centre));
        self.fonts.write(&mut self.canvas, &text, [right, below], &style.align(Align::Centre));
    }
}

/// Draws a symbol of a given radius.
pub fn draw_symbol(canvas: &mut Canvas, symbol: Symbol, [x, y]: [f64; 2], radius: f64) {
    let stroke = (radius * 0.32).max(1.2);
    match symbol {
        Symbol::Dot(colour) => {
            canvas.disc([x, y], radius, Paint::sheer(INK, 0.85));
            canvas.disc([x, y], radius * 0.68, Paint::solid(colour));
        }
        Symbol::Ring(colour) => {
            let corner = |i: u32| {
                let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 32.0);
                [x + radius * cosine, y + radius * sine]
            };
            let corners: Vec<[f64; 2]> = (0..32).map(corner).collect();
            canvas.outline(&corners, stroke, Paint::solid(colour));
        }
        Symbol::Cross(colour) => {
            let r = radius * 0.75;
            canvas.line(&[[x - r, y - r], [x + r, y + r]], stroke, Paint::solid(colour));
            canvas.line(&[[x - r, y + r], [x + r, y - r]], stroke, Paint::solid(colour));
        }
        Symbol::Crown(colour) => {
            draw_symbol(canvas, Symbol::Swatch(colour), [x, y], radius);
            draw_symbol(canvas, Symbol::Ring(PAPER), [x, y], radius * 0.72);
        }
        Symbol::Swatch(colour) => {
            canvas.rect([x - radius, y - radius], [x + radius, y + radius], Paint::solid(colour));
        }
    }
}

/// A coordinate on the frame.
fn coordinate(value: f64) -> String {
    if (value - value.round()).abs() < 1e-6 {
        grouped(value.round() as i64)
    } else {
        format!("{value:.2}")
    }
}
