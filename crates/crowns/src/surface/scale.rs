//! Centring and scaling: without it solvers stop early on world coordinates.

use super::bounds::Limits;
use super::problem::{Cell, Prior};

/// What is subtracted and divided by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Weighted mean of the cells, m.
    pub(super) centre: [f64; 3],
    /// Root mean square distance from the centre in the plane, m.
    pub(super) length_m: f64,
    /// Standard deviation of the heights, m; 1 for cells of one height.
    pub(super) height_m: f64,
}

/// Weighted mean position of the cells.
pub(super) fn mean(cells: &[Cell]) -> [f64; 3] {
    let total: f64 = cells.iter().map(|cell| cell[3]).sum();
    let add =
        |sum: [f64; 3], cell: &Cell| std::array::from_fn(|axis| sum[axis] + cell[3] * cell[axis]);
    cells.iter().fold([0.0; 3], add).map(|sum| sum / total)
}

impl Scale {
    /// The scale of a crown's cells.
    pub(super) fn of(cells: &[Cell]) -> Self {
        let centre = mean(cells);
        let (mut total, mut squares) = (0.0, [0.0; 3]);
        for cell in cells {
            total += cell[3];
            for (axis, sum) in squares.iter_mut().enumerate() {
                let offset = cell[axis] - centre[axis];
                *sum += cell[3] * offset * offset;
            }
        }
        let root = |sum: f64| if sum > 0.0 { (sum / total).sqrt() } else { 1.0 };
        let positive = |value: f64| if value > 1e-9 { value } else { 1.0 };
        Self {
            centre,
            length_m: positive(root(squares[0] + squares[1])),
            height_m: positive(root(squares[2])),
        }
    }

    /// The cells in units of the scale, weights as they are.
    pub(super) fn apply(&self, cells: &[Cell]) -> Vec<Cell> {
        let ([x0, y0, z0], l, h) = (self.centre, self.length_m, self.height_m);
        cells.iter().map(|&[x, y, z, w]| [(x - x0) / l, (y - y0) / l, (z - z0) / h, w]).collect()
    }
}

/// A paraboloid by its apex, in scaled units: z = top + phi0 dx² + phi1 dy² + phi2 dx dy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Apex {
    pub(super) curvature: [f64; 3],
    pub(super) centre: [f64; 2],
    pub(super) top: f64,
}

impl Apex {
    /// From coefficients phi0 to phi5.
    pub(super) fn from_phi([p0, p1, p2, p3, p4, p5]: [f64; 6]) -> Self {
        let det = 4.0 * p0 * p1 - p2 * p2;
        let (x, y) = ((p2 * p4 - 2.0 * p1 * p3) / det, (p2 * p3 - 2.0 * p0 * p4) / det);
        let top = p5 - (p0 * x * x + p1 * y * y + p2 * x * y);
        Self { curvature: [p0, p1, p2], centre: [x, y], top }
    }

    fn z(&self, x: f64, y: f64) -> f64 {
        let ([p0, p1, p2], [cx, cy]) = (self.curvature, self.centre);
        let (dx, dy) = (x - cx, y - cy);
        self.top + p0 * dx * dx + p1 * dy * dy + p2 * dx * dy
    }
}

/// A problem in scaled units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scaled {
    pub(super) scale: Scale,
    pub(super) cells: Vec<Cell>,
    pub(super) limits: Limits,
}

impl Scaled {
    /// `limits` in 1/m.
    pub(super) fn new(cells: &[Cell], limits: Limits) -> Self {
        let scale = Scale::of(cells);
        let factor = scale.length_m * scale.length_m / scale.height_m;
        Self { scale, cells: scale.apply(cells), limits: limits.scaled(factor) }
    }

    /// Lower and upper corner of a prior box in scaled units.
    pub(super) fn corners(&self, prior: &Prior) -> [[f64; 2]; 2] {
        prior.corners().map(|corner| self.position(corner))
    }

    pub(super) fn position(&self, at_m: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (at_m[axis] - self.scale.centre[axis]) / self.scale.length_m)
    }

    pub(super) fn objective(&self, surface: &Apex) -> f64 {
        self.cells.iter().map(|&[x, y, z, w]| w * (surface.z(x, y) - z).abs()).sum()
    }

    /// The height of the apex at which a surface of this shape and centre fits best: the weighted
    /// median of what is left of the heights (the middle of all medians).
    pub(super) fn best_top(&self, surface: &Apex) -> f64 {
        let surface = Apex { top: 0.0, ..*surface };
        let rest = self.cells.iter().map(|&[x, y, z, w]| (z - surface.z(x, y), w));
        let mut rest: Vec<(f64, f64)> = rest.collect();
        rest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let half = 0.5 * rest.iter().map(|(_, w)| w).sum::<f64>();
        let mut below = 0.0;
        for (index, (value, weight)) in rest.iter().enumerate() {
            below += weight;
            if below > half {
                return *value;
            }
            if below == half {
                return rest.get(index + 1).map_or(*value, |next| 0.5 * (value + next.0));
            }
        }
        0.0
    }

    /// Back to metres in the problem's frame: curvatures in 1/m, centre and top.
    pub(super) fn in_metres(&self, surface: &Apex) -> Apex {
        let Scale { centre, length_m: l, height_m: h } = self.scale;
        Apex {
            curvature: surface.curvature.map(|c| c * h / (l * l)),
            centre: [0, 1].map(|axis| surface.centre[axis] * l + centre[axis]),
            top: surface.top * h + centre[2],
        }
    }
}
