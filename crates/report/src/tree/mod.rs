//! The picture of one tree: its points beside its model, from two sides.

mod render;

use crate::Error;
use crate::canvas::{Canvas, Paint};
use crate::colour::{GREY, INK, PAPER, Rgb, mix};
use crate::text::{Align, Fonts, Style, grouped};
use crate::ticks::{decimals, round_below, ticks};
use render::Raster;
pub use render::{Ball, Rod, View};
use timberline_pointcloud::Bounds3;

/// What a picture shows. Positions are in any one frame, z upwards.
#[derive(Debug, Clone, Copy)]
pub struct TreePicture<'a> {
    /// Heading.
    pub title: &'a str,
    /// Lines below it.
    pub lines: &'a [String],
    /// The points, m, with how likely each is on wood, 0 to 1 (NaN: not known).
    pub points: &'a [([f64; 3], f32)],
    /// The cylinders.
    pub rods: &'a [Rod],
    /// Base of the stem, m: heights count from there.
    pub base_m: [f64; 3],
    /// Colours and what they mean.
    pub legend: &'a [(Rgb, String)],
}

/// Points on wood, and on leaves.
const WOOD: Rgb = [134, 92, 54];
const LEAF: Rgb = [92, 150, 66];
/// Where nothing is known about wood.
const PLAIN: Rgb = [96, 110, 124];
/// Height of the panels and widest row of them, pixels.
const PANEL_PX: f64 = 1200.0;
const WIDEST_PX: f64 = 3000.0;
/// Least width of a panel: room for its caption.
const NARROWEST_PX: f64 = 300.0;
const TEXT_PX: f64 = 26.0;
const LEFT_PX: f64 = 110.0;
const RIGHT_PX: f64 = 40.0;
const GAP_PX: f64 = 24.0;
const BOTTOM_PX: f64 = 150.0;
/// Breast height above the base, m.
const BREAST_HEIGHT_M: f64 = 1.3;
/// Surroundings shown around the tree, as a share of its size.
const MARGIN: f64 = 0.03;

/// Where the panels are.
struct Layout {
    bounds: Bounds3,
    px_per_m: f64,
    top: f64,
    /// Left edge and width of each panel.
    panels: [(f64, f64); 4],
    height: f64,
}

impl Layout {
    fn of(picture: &TreePicture<'_>) -> Result<Self, Error> {
        let bounds =
            bounds(picture).ok_or(Error::Empty("the tree has neither points nor cylinders"))?;
        let size: [f64; 3] = std::array::from_fn(|axis| bounds.max[axis] - bounds.min[axis]);
        let across = 2.0 * (size[0] + size[1]);
        let px_per_m = (PANEL_PX / size[2]).min(WIDEST_PX / across);
        let widths = [size[0], size[0], size[1], size[1]].map(|m| (m * px_per_m).max(NARROWEST_PX));
        let mut left = LEFT_PX;
        let panels = widths.map(|width| {
            let panel = (left.round(), width.round());
            left += width.round() + GAP_PX;
            panel
        });
        let top = TEXT_PX * (3.6 + 1.35 * picture.lines.len() as f64) + 1.6 * TEXT_PX;
        Ok(Self { bounds, px_per_m, top, panels, height: (size[2] * px_per_m).ceil() })
    }

    fn canvas(&self) -> Canvas {
        let (left, width) = self.panels[3];
        let size = [left + width + RIGHT_PX, self.top + self.height + BOTTOM_PX];
        Canvas::new(size[0].ceil() as u32, size[1].ceil() as u32, PAPER)
    }

    /// The page's y of an elevation.
    fn y(&self, z_m: f64) -> f64 {
        self.top + (self.bounds.max[2] - z_m) * self.px_per_m
    }

    /// What a panel looks at.
    fn view(&self, panel: usize) -> View {
        let middle = |axis: usize| (self.bounds.min[axis] + self.bounds.max[axis]) / 2.0;
        let width = self.panels[panel].1;
        let centre = if panel < 2 { middle(0) } else { middle(1) };
        View {
            from_east: panel >= 2,
            left_m: centre - width / 2.0 / self.px_per_m,
            top_m: self.bounds.max[2],
            px_per_m: self.px_per_m,
        }
    }
}

/// The box around everything with a margin, at least a metre high; none without anything finite.
fn bounds(picture: &TreePicture<'_>) -> Option<Bounds3> {
    let mut bounds = Bounds3::EMPTY;
    let is_finite = |p: &[f64; 3]| p.iter().all(|value| value.is_finite());
    picture.points.iter().map(|(p, _)| *p).filter(is_finite).for_each(|p| bounds.include(p));
    for rod in picture.rods.iter().filter(|rod| rod.is_finite()) {
        for end in rod.ends_m {
            bounds.include(end.map(|value| value - rod.radius_m));
            bounds.include(end.map(|value| value + rod.radius_m));
        }
    }
    if bounds.is_empty() {
        return None;
    }
    let size = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]).fold(1.0, f64::max);
    for axis in 0..3 {
        bounds.min[axis] -= MARGIN * size;
        bounds.max[axis] += MARGIN * size;
    }
    Some(bounds)
}

/// Draws a tree.
///
/// # Errors
/// [`Error::Empty`] without points and cylinders, [`Error::Font`].
pub fn draw(picture: &TreePicture<'_>) -> Result<Canvas, Error> {
    let layout = Layout::of(picture)?;
    let fonts = Fonts::load()?;
    let mut canvas = layout.canvas();
    for panel in 0..4 {
        let (left, width) = layout.panels[panel];
        let mut raster = Raster::new(width as usize, layout.height as usize);
        let view = layout.view(panel);
        if panel % 2 == 0 {
            let balls = picture.points.iter().map(|(position_m, wood)| Ball {
                position_m: *position_m,
                colour: if wood.is_nan() { PLAIN } else { mix(LEAF, WOOD, f64::from(*wood)) },
            });
            raster.points(&view, balls);
        } else {
            raster.rods(&view, picture.rods);
        }
        raster.copy_to(&mut canvas, [left, layout.top]);
    }
    let page = Page { picture, layout: &layout, fonts: &fonts };
    page.heights(&mut canvas);
    page.captions(&mut canvas);
    page.heading(&mut canvas);
    page.footer(&mut canvas);
    Ok(canvas)
}

/// What stands around the panels.
struct Page<'a> {
    picture: &'a TreePicture<'a>,
    layout: &'a Layout,
    fonts: &'a Fonts,
}

impl Page<'_> {
    fn style(&self, share: f64, colour: Rgb) -> Style {
        Style::new(share * TEXT_PX, Paint::solid(colour))
    }

    /// Heights above the base along the left edge, and a line at breast height.
    fn heights(&self, canvas: &mut Canvas) {
        let Layout { bounds, panels, top, height, .. } = self.layout;
        let right = panels[3].0 + panels[3].1;
        let base = self.picture.base_m[2];
        let (low, high) = (bounds.min[2] - base, bounds.max[2] - base);
        let values = ticks(low, high, height / (3.0 * TEXT_PX));
        let step = values.windows(2).map(|pair| pair[1] - pair[0]).next().unwrap_or(1.0);
        let style = self.style(0.85, GREY).align(Align::Right);
        for value in values {
            let y = self.layout.y(base + value);
            canvas.line(&[[LEFT_PX, y], [right, y]], 1.0, Paint::sheer(GREY, 0.22));
            let text = format!("{value:.*}", decimals(step));
            self.fonts.write(canvas, &text, [LEFT_PX - 12.0, y + 0.3 * TEXT_PX], &style);
        }
        let middle = top + height / 2.0;
        let style = self.style(0.85, GREY).align(Align::Centre);
        self.fonts.write_upwards(canvas, "height above the base [m]", [30.0, middle], &style);
        let y = self.layout.y(base + BREAST_HEIGHT_M);
        let mut x = LEFT_PX;
        while x < right && (low..high).contains(&BREAST_HEIGHT_M) {
            let dash = [[x, y], [(x + 14.0).min(right), y]];
            canvas.line(&dash, 2.0, Paint::sheer(INK, 0.6));
            x += 28.0;
        }
    }

    fn captions(&self, canvas: &mut Canvas) {
        let captions = ["points, from the south", "model", "points, from the east", "model"];
        let style = self.style(0.9, INK).align(Align::Centre);
        for (text, (left, width)) in captions.into_iter().zip(self.layout.panels) {
            let place = [left + width / 2.0, self.layout.top - 0.5 * TEXT_PX];
            self.fonts.write(canvas, text, place, &style);
        }
    }

    fn heading(&self, canvas: &mut Canvas) {
        let style = self.style(1.6, INK).bold();
        self.fonts.write(canvas, self.picture.title, [LEFT_PX, 2.4 * TEXT_PX], &style);
        for (number, line) in self.picture.lines.iter().enumerate() {
            let y = TEXT_PX * (4.0 + 1.35 * number as f64);
            self.fonts.write(canvas, line, [LEFT_PX, y], &self.style(1.0, INK));
        }
    }

    /// Scale bar and legend.
    fn footer(&self, canvas: &mut Canvas) {
        let Layout { px_per_m, top, height, panels, .. } = self.layout;
        let y = top + height + 2.0 * TEXT_PX;
        let metres = round_below(0.8 * panels[0].1 / px_per_m);
        let end = LEFT_PX + metres * px_per_m;
        let ink = Paint::solid(INK);
        canvas.line(&[[LEFT_PX, y], [end, y]], 4.0, ink);
        for x in [LEFT_PX, end] {
            canvas.line(&[[x, y - 9.0], [x, y + 9.0]], 3.0, ink);
        }
        let text = if metres < 1.0 {
            format!("{:.0} cm", metres * 100.0)
        } else {
            format!("{metres:.0} m")
        };
        let style = self.style(0.95, INK);
        let place = [(LEFT_PX + end) / 2.0, y + 1.35 * TEXT_PX];
        self.fonts.write(canvas, &text, place, &style.align(Align::Centre));
        let mut x = panels[1].0.max(end + 2.0 * TEXT_PX);
        let mut row = y + 0.3 * TEXT_PX;
        let points = grouped(self.picture.points.len() as i64);
        let known = self.picture.points.iter().any(|(_, wood)| !wood.is_nan());
        let mut entries = self.picture.legend.to_vec();
        if known {
            entries.push((WOOD, format!("{points} points: wood")));
            entries.push((LEAF, "leaves".to_owned()));
        } else {
            entries.push((PLAIN, format!("{points} points")));
        }
        let right = panels[3].0 + panels[3].1;
        for (colour, text) in entries {
            let width = 2.4 * TEXT_PX + self.fonts.width(&text, &style);
            if x + width > right {
                x = panels[1].0.max(end + 2.0 * TEXT_PX);
                row += 1.4 * TEXT_PX;
            }
            canvas.disc(
                [x + 0.4 * TEXT_PX, row - 0.3 * TEXT_PX],
                0.38 * TEXT_PX,
                Paint::solid(colour),
            );
            self.fonts.write(canvas, &text, [x + 1.1 * TEXT_PX, row], &style);
            x += width;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: Rgb = [0, 158, 115];

    fn stem() -> Rod {
        Rod {
            ends_m: [[0.0, 0.0, 0.0], [0.0, 0.0, 10.0]],
            radius_m: 0.25,
            colour: GREEN,
            flat_start: true,
        }
    }

    fn picture<'a>(points: &'a [([f64; 3], f32)], rods: &'a [Rod]) -> TreePicture<'a> {
        TreePicture { title: "Tree", lines: &[], points, rods, base_m: [0.0; 3], legend: &[] }
    }

    /// Pixels in which green outweighs red by far, column by column.
    fn green(canvas: &Canvas) -> Vec<(i64, i64)> {
        let size = (i64::from(canvas.width()), i64::from(canvas.height()));
        let all = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
        let is_green = |(x, y): &(i64, i64)| {
            canvas.pixel(*x, *y).is_some_and(|[r, g, _]| f64::from(g) > 3.0 * f64::from(r) + 10.0)
        };
        all.filter(is_green).collect()
    }

    #[test]
    fn a_stem_is_drawn_twice_at_its_size() {
        let rods = [stem()];
        let picture = picture(&[], &rods);
        let layout = Layout::of(&picture).unwrap();
        let canvas = draw(&picture).unwrap();
        let drawn = green(&canvas);
        let expected = 2.0 * 0.5 * 10.0 * layout.px_per_m * layout.px_per_m;
        let share = drawn.len() as f64 / expected;
        // Round ends, shade at the edges.
        assert!((0.85..1.1).contains(&share), "{share}");
        for panel in [0, 2] {
            let (left, width) = layout.panels[panel];
            assert!(!drawn.iter().any(|(x, _)| (left..left + width).contains(&(*x as f64))));
        }
    }

    #[test]
    fn nearer_things_hide_farther_ones() {
        // From the south, the south (small y) is in front.
        let behind = Rod { ends_m: [[0.0, 2.0, 0.0], [0.0, 2.0, 10.0]], ..stem() };
        let front = Rod { colour: [200, 0, 0], radius_m: 0.5, ..stem() };
        for rods in [[behind, front], [front, behind]] {
            let picture = picture(&[], &rods);
            let layout = Layout::of(&picture).unwrap();
            let seen = green(&draw(&picture).unwrap());
            let (left, width) = layout.panels[1];
            assert!(!seen.iter().any(|(x, _)| (left..left + width).contains(&(*x as f64))));
            assert!(!seen.is_empty());
        }
    }

    #[test]
    fn odd_input_is_drawn_or_refused() {
        assert!(matches!(draw(&picture(&[], &[])), Err(Error::Empty(_))));
        let lost = [([f64::NAN; 3], 0.5)];
        assert!(matches!(draw(&picture(&lost, &[])), Err(Error::Empty(_))));
        let one = [([0.0; 3], f32::NAN)];
        draw(&picture(&one, &[])).unwrap();
        let flat = Rod { ends_m: [[0.0; 3]; 2], ..stem() };
        draw(&picture(&lost, &[flat, Rod { radius_m: f64::NAN, ..stem() }])).unwrap();
        // A fallen tree is wider than high.
        let fallen = Rod { ends_m: [[0.0; 3], [30.0, 5.0, 0.5]], ..stem() };
        let canvas = draw(&picture(&[], &[fallen])).unwrap();
        assert!(canvas.width() < 4000 && canvas.height() < 2000);
    }
}
