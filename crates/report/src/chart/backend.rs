//! A canvas as something plotters draws on.

use crate::canvas::{Canvas, Paint};
use crate::text::{Align, Fonts, Style};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle, FontTransform,
};
use std::convert::Infallible;

/// Height of a text as plotters counts it, in ems; also what its SVG divides by.
const TEXT_PER_EM: f64 = 1.24;
/// Where the base line stands below the top of a text and below its middle, in ems: what SVG files
/// of plotters say.
const BELOW_TOP_EM: f64 = 0.76;
const BELOW_MIDDLE_EM: f64 = 0.27;

/// Draws on a canvas.
pub(super) struct Pen<'a> {
    pub(super) canvas: &'a mut Canvas,
    pub(super) fonts: &'a Fonts,
}

/// Drawing in memory cannot fail.
type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl Pen<'_> {
    fn stroke(&mut self, corners: &[BackendCoord], style: &impl BackendStyle) {
        let corners: Vec<[f64; 2]> = corners.iter().map(|&place| middle(place)).collect();
        let width = f64::from(style.stroke_width());
        self.canvas.line(&corners, width, paint(style.color()));
    }
}

/// Middle of a pixel.
fn middle((x, y): BackendCoord) -> [f64; 2] {
    [f64::from(x) + 0.5, f64::from(y) + 0.5]
}

fn paint(colour: BackendColor) -> Paint {
    let (red, green, blue) = colour.rgb;
    Paint::sheer([red, green, blue], colour.alpha)
}

/// The style of a text in our terms.
fn text_style(style: &impl BackendTextStyle) -> Style {
    let align = match style.anchor().h_pos {
        HPos::Left => Align::Left,
        HPos::Right => Align::Right,
        HPos::Center => Align::Centre,
    };
    let plain = Style::new(style.size(), paint(style.color())).align(align);
    if matches!(style.style(), FontStyle::Bold) { plain.bold() } else { plain }
}

impl DrawingBackend for Pen<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.canvas.width(), self.canvas.height())
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, colour: BackendColor) -> Drawn {
        self.canvas.blend(i64::from(x), i64::from(y), paint(colour), 1.0);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.stroke(&[from, to], style);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        self.stroke(&path.into_iter().collect::<Vec<_>>(), style);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let (centre, radius) = (middle(centre), f64::from(radius));
        if fill {
            self.canvas.disc(centre, radius, paint(style.color()));
            return Ok(());
        }
        let corner = |i: u32| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 32.0);
            [centre[0] + radius * cosine, centre[1] + radius * sine]
        };
        let corners: Vec<[f64; 2]> = (0..32).map(corner).collect();
        let width = f64::from(style.stroke_width());
        self.canvas.outline(&corners, width, paint(style.color()));
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        place: BackendCoord,
    ) -> Drawn {
        let em = style.size() / TEXT_PER_EM;
        let below = match style.anchor().v_pos {
            VPos::Top => BELOW_TOP_EM * em,
            VPos::Center => BELOW_MIDDLE_EM * em,
            VPos::Bottom => -BELOW_MIDDLE_EM * em,
        };
        let (x, y) = (f64::from(place.0), f64::from(place.1));
        let own = text_style(style);
        if matches!(style.transform(), FontTransform::Rotate270) {
            self.fonts.write_upwards(self.canvas, text, [x + below, y], &own);
        } else {
            self.fonts.write(self.canvas, text, [x, y + below], &own);
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let width = self.fonts.width(text, &text_style(style));
        Ok((width.ceil() as u32, style.size().ceil() as u32))
    }
}
