//! Text in DejaVu Sans (Bitstream Vera licence), which comes with the program.

use crate::Error;
use crate::canvas::{Canvas, Paint};
use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

/// Where a text stands relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// It begins there.
    Left,
    /// Its middle is there.
    Centre,
    /// It ends there.
    Right,
}

/// The two faces.
#[derive(Debug, Clone)]
pub struct Fonts {
    regular: FontRef<'static>,
    bold: FontRef<'static>,
}

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Height in pixels from the lowest descender to the highest ascender.
    pub size: f64,
    /// Bold or regular.
    pub bold: bool,
    /// Alignment.
    pub align: Align,
    /// Paint.
    pub paint: Paint,
}

impl Style {
    /// Regular, left-aligned.
    #[must_use]
    pub fn new(size: f64, paint: Paint) -> Self {
        Self { size, bold: false, align: Align::Left, paint }
    }

    /// The same with another alignment.
    #[must_use]
    pub fn align(self, align: Align) -> Self {
        Self { align, ..self }
    }

    /// The same in bold.
    #[must_use]
    pub fn bold(self) -> Self {
        Self { bold: true, ..self }
    }
}

impl Fonts {
    /// Loads the faces.
    ///
    /// # Errors
    /// [`Error::Font`].
    pub fn load() -> Result<Self, Error> {
        Ok(Self {
            regular: FontRef::try_from_slice(dejavu::sans::regular())?,
            bold: FontRef::try_from_slice(dejavu::sans::bold())?,
        })
    }

    fn face(&self, style: &Style) -> &FontRef<'static> {
        if style.bold { &self.bold } else { &self.regular }
    }

    /// Width of a text in pixels.
    #[must_use]
    pub fn width(&self, text: &str, style: &Style) -> f64 {
        let face = self.face(style).as_scaled(PxScale::from(style.size as f32));
        let (mut width, mut last) = (0.0, None);
        for character in text.chars() {
            let glyph = face.glyph_id(character);
            width += last.map_or(0.0, |last| face.kern(last, glyph)) + face.h_advance(glyph);
            last = Some(glyph);
        }
        f64::from(width)
    }

    /// Writes a text with its base line at a position.
    pub fn write(&self, canvas: &mut Canvas, text: &str, [x, y]: [f64; 2], style: &Style) {
        let x = match style.align {
            Align::Left => x,
            Align::Centre => x - self.width(text, style) / 2.0,
            Align::Right => x - self.width(text, style),
        };
        self.rasterise(text, [x, y], style, |x, y, cover| {
            canvas.blend(x, y, style.paint, cover);
        });
    }

    /// Writes a text that reads upwards, its base line going up from a position.
    pub fn write_upwards(&self, canvas: &mut Canvas, text: &str, [x, y]: [f64; 2], style: &Style) {
        let start = match style.align {
            Align::Left => 0.0,
            Align::Centre => -self.width(text, style) / 2.0,
            Align::Right => -self.width(text, style),
        };
        let (x, y) = (x.round() as i64, y.round() as i64);
        self.rasterise(text, [start, 0.0], style, |along, below, cover| {
            canvas.blend(x + below, y - along, style.paint, cover);
        });
    }

    /// Calls `visit` with every pixel of a text on a horizontal base line and how much it covers.
    fn rasterise(
        &self,
        text: &str,
        [x, y]: [f64; 2],
        style: &Style,
        mut visit: impl FnMut(i64, i64, f64),
    ) {
        let scale = PxScale::from(style.size as f32);
        let face = self.face(style).as_scaled(scale);
        let (mut place, mut last) = (x as f32, None);
        for character in text.chars() {
            let glyph = face.glyph_id(character);
            place += last.map_or(0.0, |last| face.kern(last, glyph));
            let placed = glyph.with_scale_and_position(scale, point(place, y as f32));
            if let Some(outline) = face.outline_glyph(placed) {
                let corner = outline.px_bounds().min;
                outline.draw(|column, row, cover| {
                    let x = i64::from(column) + corner.x as i64;
                    let y = i64::from(row) + corner.y as i64;
                    visit(x, y, f64::from(cover));
                });
            }
            place += face.h_advance(glyph);
            last = Some(glyph);
        }
    }

    /// Writes a text with a light rim, readable on any ground.
    pub fn write_on_map(&self, canvas: &mut Canvas, text: &str, [x, y]: [f64; 2], style: &Style) {
        let rim = Style { paint: Paint::sheer(crate::colour::PAPER, 0.5), ..*style };
        let step = (style.size / 14.0).max(1.0);
        for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)] {
            let place = [x + f64::from(dx) * step, y + f64::from(dy) * step];
            self.write(canvas, text, place, &rim);
        }
        self.write(canvas, text, [x, y], style);
    }
}

/// A whole number with its digits in groups of three.
#[must_use]
pub fn grouped(value: i64) -> String {
    let digits = value.unsigned_abs().to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push('\u{202F}');
        }
        text.push(digit);
    }
    if value < 0 { format!("-{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stands_where_it_should() {
        let fonts = Fonts::load().unwrap();
        let style = Style::new(20.0, Paint::solid([0; 3]));
        let width = fonts.width("Height [m²]", &style);
        assert!(width > 60.0 && width < 130.0, "{width}");
        let mut canvas = Canvas::new(200, 40, [255; 3]);
        fonts.write(&mut canvas, "Height [m²]", [190.0, 30.0], &style.align(Align::Right));
        let dark = |x: i64| (0..40).any(|y| canvas.pixel(x, y).unwrap()[0] < 100);
        assert!(dark(188) || dark(187) || dark(186));
        assert!((0..60).all(|x| !dark(x)) && (191..200).all(|x| !dark(x)));
    }

    #[test]
    fn turned_text_is_the_same_text() {
        let fonts = Fonts::load().unwrap();
        let style = Style::new(20.0, Paint::solid([0; 3]));
        let mut flat = Canvas::new(60, 60, [255; 3]);
        fonts.write(&mut flat, "Fg", [10.0, 40.0], &style);
        let mut turned = Canvas::new(60, 60, [255; 3]);
        fonts.write_upwards(&mut turned, "Fg", [40.0, 49.0], &style);
        for (x, y) in (0..60).flat_map(|x| (0..60).map(move |y| (x, y))) {
            assert_eq!(flat.pixel(x, y), turned.pixel(y, 59 - x), "{x} {y}");
        }
    }

    #[test]
    fn digits_are_grouped() {
        let text = |value| grouped(value).replace('\u{202F}', " ");
        assert_eq!(
            [text(0), text(999), text(3_813_056), text(-1000)],
            ["0", "999", "3 813 056", "-1 000"]
        );
    }
}
