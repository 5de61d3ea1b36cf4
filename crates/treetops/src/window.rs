//! The window of a point.

use crate::{Params, WindowKind};
use timberline_pointcloud::frame::TICKS_PER_M;

/// A window, closed on all sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// Diameter or edge, metres.
    pub(crate) size_m: f64,
    square: bool,
}

impl Window {
    /// The window of a point of the given height above ground.
    pub(crate) fn at_height(params: &Params, height_m: f64) -> Self {
        let size_m = match params.window {
            WindowKind::Variable => {
                let grown = params.window_base_m + params.window_per_height * height_m.max(0.0);
                grown.min(params.window_max_m)
            }
            WindowKind::Circle | WindowKind::Square => params.window_m,
        };
        Self { size_m, square: params.window == WindowKind::Square }
    }

    /// The same window, at least `size_m` wide.
    pub(crate) fn widened(self, size_m: f64) -> Self {
        Self { size_m: self.size_m.max(size_m), ..self }
    }

    /// Half the size: how far the window reaches along an axis.
    pub(crate) fn reach_m(&self) -> f64 {
        self.size_m / 2.0
    }

    /// Whether an offset from the centre, in ticks, lies in the window.
    pub(crate) fn contains(&self, [dx, dy]: [f64; 2]) -> bool {
        let reach = self.reach_m() * TICKS_PER_M;
        if self.square {
            dx.abs().max(dy.abs()) <= reach
        } else {
            dx * dx + dy * dy <= reach * reach
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_border_belongs_to_the_window() {
        let circle = Window::at_height(&Params::fixed_circle(3.0), 9.0);
        assert!(circle.contains([15_000.0, 0.0]) && !circle.contains([15_000.0, 1.0]));
        let square = Window::at_height(&Params::paper(), 9.0);
        assert!(square.contains([7_500.0, -7_500.0]) && !square.contains([7_501.0, 0.0]));
    }

    #[test]
    fn the_variable_window_grows_to_its_largest() {
        let params = Params {
            window_base_m: 2.0,
            window_per_height: 0.1,
            window_max_m: 5.0,
            ..Params::default()
        };
        let sizes = [0.0, 10.0, 30.0, 80.0].map(|h| Window::at_height(&params, h).size_m);
        assert_eq!(sizes, [2.0, 3.0, 5.0, 5.0]);
    }
}
