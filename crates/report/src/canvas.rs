//! A picture in memory, with smooth discs, lines and areas.

use crate::Error;
use crate::colour::{Rgb, mix};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rayon::prelude::*;
use std::path::Path;

/// Rows of pixels from the top left. Positions are in pixels; the middle of the first is (0.5, 0.5).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    pixels: Vec<Rgb>,
}

/// How something is painted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Colour.
    pub colour: Rgb,
    /// 0 is invisible, 1 hides what is below.
    pub alpha: f64,
}

impl Paint {
    /// A paint that hides what is below.
    #[must_use]
    pub fn solid(colour: Rgb) -> Self {
        Self { colour, alpha: 1.0 }
    }

    /// A paint that lets through what is below.
    #[must_use]
    pub fn sheer(colour: Rgb, alpha: f64) -> Self {
        Self { colour, alpha }
    }
}

impl Canvas {
    /// A picture of one colour.
    #[must_use]
    pub fn new(width: u32, height: u32, colour: Rgb) -> Self {
        Self { width, height, pixels: vec![colour; width as usize * height as usize] }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The colour of a pixel, if it is inside.
    #[must_use]
    pub fn pixel(&self, x: i64, y: i64) -> Option<Rgb> {
        self.place(x, y).map(|place| self.pixels[place])
    }

    /// Paints one pixel with a share of a paint; outside nothing happens.
    pub fn blend(&mut self, x: i64, y: i64, paint: Paint, share: f64) {
        if let Some(place) = self.place(x, y) {
            let share = (paint.alpha * share).clamp(0.0, 1.0);
            self.pixels[place] = mix(self.pixels[place], paint.colour, share);
        }
    }

    fn place(&self, x: i64, y: i64) -> Option<usize> {
        let inside =
            (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        inside.then(|| y as usize * self.width as usize + x as usize)
    }

    /// The rows from `first` on, `count` of them, in bands of `height` rows (the last may be lower).
    pub(crate) fn bands(
        &mut self,
        first: usize,
        count: usize,
        height: usize,
    ) -> impl IndexedParallelIterator<Item = &mut [Rgb]> {
        let width = self.width as usize;
        self.pixels[first * width..(first + count) * width].par_chunks_mut(height * width)
    }

    /// Paints a rectangle given by two corners, edges rounded to whole pixels.
    pub fn rect(&mut self, [left, top]: [f64; 2], [right, bottom]: [f64; 2], paint: Paint) {
        for y in top.round() as i64..bottom.round() as i64 {
            for x in left.round() as i64..right.round() as i64 {
                self.blend(x, y, paint, 1.0);
            }
        }
    }

    /// Paints a disc with a smooth edge.
    pub fn disc(&mut self, [x, y]: [f64; 2], radius: f64, paint: Paint) {
        let low = |centre: f64| (centre - radius - 1.0).floor() as i64;
        let high = |centre: f64| (centre + radius + 1.0).ceil() as i64;
        for row in low(y)..high(y) {
            for column in low(x)..high(x) {
                let (dx, dy) = (column as f64 + 0.5 - x, row as f64 + 0.5 - y);
                let cover = radius + 0.5 - (dx * dx + dy * dy).sqrt();
                self.blend(column, row, paint, cover.clamp(0.0, 1.0));
            }
        }
    }

    /// Paints a line through corners. Every pixel is painted once, also where pieces meet.
    pub fn line(&mut self, corners: &[[f64; 2]], width: f64, paint: Paint) {
        let reach = width / 2.0 + 1.0;
        let Some(bounds) = self.pixels_around(corners, reach) else { return };
        let ([left, top], [columns, rows]) = bounds;
        let mut cover = vec![0.0_f32; columns * rows];
        for piece in corners.windows(2) {
            cover_segment(&mut cover, bounds, [piece[0], piece[1]], width);
        }
        for (place, share) in cover.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (x, y) = ((place % columns) as i64 + left, (place / columns) as i64 + top);
            self.blend(x, y, paint, f64::from(*share));
        }
    }

    /// Paints the outline of a polygon.
    pub fn outline(&mut self, corners: &[[f64; 2]], width: f64, paint: Paint) {
        let closed: Vec<[f64; 2]> = corners.iter().chain(corners.first()).copied().collect();
        self.line(&closed, width, paint);
    }

    /// Paints the inside of a polygon (even-odd rule, pixel centres).
    pub fn polygon(&mut self, corners: &[[f64; 2]], paint: Paint) {
        let Some(([left, top], [columns, rows])) = self.pixels_around(corners, 1.0) else { return };
        for y in top..top + rows as i64 {
            for x in left..left + columns as i64 {
                if is_inside(corners, [x as f64 + 0.5, y as f64 + 0.5]) {
                    self.blend(x, y, paint, 1.0);
                }
            }
        }
    }

    /// The pixels of the picture around corners: first pixel and size; `None` when there are none.
    fn pixels_around(&self, corners: &[[f64; 2]], reach: f64) -> Option<([i64; 2], [usize; 2])> {
        let range = |axis: usize, size: u32| {
            let values = || corners.iter().map(|corner| corner[axis]);
            let low = values().fold(f64::INFINITY, f64::min) - reach;
            let high = values().fold(f64::NEG_INFINITY, f64::max) + reach;
            let low = (low.floor().max(0.0)) as i64;
            let high = (high.ceil().min(f64::from(size))) as i64;
            (high > low).then(|| (low, (high - low) as usize))
        };
        let (left, columns) = range(0, self.width)?;
        let (top, rows) = range(1, self.height)?;
        Some(([left, top], [columns, rows]))
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn write_png(&self, path: &Path) -> Result<(), Error> {
        let fail = |source| Error::Write { path: path.to_path_buf(), source };
        let file = std::fs::File::create(path).map_err(|error| fail(error.into()))?;
        self.encode(std::io::BufWriter::new(file)).map_err(fail)
    }

    /// The picture as PNG.
    ///
    /// # Errors
    /// [`Error::Encode`].
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes).map_err(Error::Encode)?;
        Ok(bytes)
    }

    fn encode(&self, out: impl std::io::Write) -> Result<(), image::ImageError> {
        let encoder =
            PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive);
        let pixels = self.pixels.as_flattened();
        encoder.write_image(pixels, self.width, self.height, ExtendedColorType::Rgb8)
    }
}

/// Raises the cover of the pixels near a piece of a line.
fn cover_segment(
    cover: &mut [f32],
    ([left, top], [columns, rows]): ([i64; 2], [usize; 2]),
    [from, to]: [[f64; 2]; 2],
    width: f64,
) {
    let reach = width / 2.0 + 1.0;
    let range = |axis: usize, first: i64, count: usize| {
        let low = (from[axis].min(to[axis]) - reach).floor() as i64 - first;
        let high = (from[axis].max(to[axis]) + reach).ceil() as i64 - first;
        low.clamp(0, count as i64) as usize..high.clamp(0, count as i64) as usize
    };
    let along = [to[0] - from[0], to[1] - from[1]];
    let length2 = (along[0] * along[0] + along[1] * along[1]).max(1e-12);
    for row in range(1, top, rows) {
        for column in range(0, left, columns) {
            let centre = [(column as i64 + left) as f64 + 0.5, (row as i64 + top) as f64 + 0.5];
            let offset = [centre[0] - from[0], centre[1] - from[1]];
            let share = (offset[0] * along[0] + offset[1] * along[1]) / length2;
            let share = share.clamp(0.0, 1.0);
            let (dx, dy) = (offset[0] - share * along[0], offset[1] - share * along[1]);
            let value = (width / 2.0 + 0.5 - (dx * dx + dy * dy).sqrt()).clamp(0.0, width.min(1.0));
            let place = &mut cover[row * columns + column];
            *place = place.max(value as f32);
        }
    }
}

fn is_inside(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let ends = corners.iter().cycle().skip(1);
    let crossings = corners.iter().zip(ends).filter(|([ax, ay], [bx, by])| {
        (*ay > y) != (*by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: Paint = Paint { colour: [0; 3], alpha: 1.0 };

    fn darkness(canvas: &Canvas) -> f64 {
        canvas.pixels.iter().map(|pixel| 1.0 - f64::from(pixel[0]) / 255.0).sum()
    }

    fn painted(paint: impl FnOnce(&mut Canvas)) -> f64 {
        let mut canvas = Canvas::new(64, 48, [255; 3]);
        paint(&mut canvas);
        darkness(&canvas)
    }

    #[test]
    fn areas_are_right() {
        let disc = painted(|c| c.disc([30.2, 20.7], 10.0, BLACK));
        assert!((disc - 314.2).abs() < 3.0, "{disc}");
        let line = painted(|c| c.line(&[[10.0, 10.0], [50.0, 10.0], [50.0, 40.0]], 3.0, BLACK));
        assert!((line - 3.0 * 70.0).abs() < 9.0, "{line}");
        let corners = [[10.0, 10.0], [30.0, 10.0], [30.0, 40.0], [10.0, 40.0]];
        assert_eq!(painted(|c| c.polygon(&corners, BLACK)), 600.0);
    }

    #[test]
    fn outside_nothing_happens() {
        assert_eq!(painted(|c| c.line(&[[-50.0, -9.0], [-20.0, -9.0]], 3.0, BLACK)), 0.0);
        assert_eq!(painted(|c| c.disc([-20.0, 500.0], 10.0, BLACK)), 0.0);
        assert_eq!(painted(|c| c.outline(&[], 1.0, BLACK)), 0.0);
        assert_eq!(painted(|c| c.polygon(&[[1e9, 0.0], [2e9, 0.0], [2e9, 5.0]], BLACK)), 0.0);
    }

    #[test]
    fn sheer_lines_do_not_darken_where_pieces_meet() {
        let mut canvas = Canvas::new(40, 40, [255; 3]);
        canvas.outline(&[[5.0, 5.0], [30.0, 5.0], [30.0, 30.0]], 3.0, Paint::sheer([0; 3], 0.5));
        assert!(canvas.pixels.iter().all(|pixel| pixel[0] >= 127));
    }

    #[test]
    fn a_png_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let mut canvas = Canvas::new(8, 4, [1, 2, 3]);
        canvas.rect([2.0, 1.0], [5.0, 3.0], Paint::solid([200, 100, 50]));
        canvas.write_png(&path).unwrap();
        let read = image::open(&path).unwrap().into_rgb8();
        assert_eq!(read.dimensions(), (8, 4));
        assert_eq!(read.into_raw(), canvas.pixels.as_flattened());
    }
}
