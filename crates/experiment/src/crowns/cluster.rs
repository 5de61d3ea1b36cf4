//! A tree's points and where the tree really stands.

use timberline_crowns::footprint::footprint;

/// The points taken for one tree, and its reference position.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cluster {
    /// Number, unique among the clusters of a run.
    pub id: u64,
    /// Which repetition of its dataset it belongs to.
    pub repeat: u64,
    /// Points in any one metric frame, best near the tree.
    pub points: Vec<[f64; 3]>,
    /// Position of the stem in the same frame, m.
    pub reference: [f64; 2],
    /// Height of the tree, m; NaN where unknown.
    pub height_m: f64,
    /// What is wrong with the segment, where that is known; see [`super::segment`].
    pub faults: Vec<&'static str>,
}

/// Size and density of a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Radius of the smallest circle around the points, m.
    pub enclosing_radius_m: f64,
    /// Area of the convex hull, m².
    pub hull_m2: f64,
    /// Points per square metre of the hull; 0 without area.
    pub density_per_m2: f64,
}

impl Cluster {
    /// The highest point (the first of equals); none of no points.
    #[must_use]
    pub fn highest(&self) -> Option<[f64; 3]> {
        let higher = |best: [f64; 3], p: &[f64; 3]| if p[2] > best[2] { *p } else { best };
        let (first, rest) = self.points.split_first()?;
        Some(rest.iter().fold(*first, higher))
    }

    /// Size and density.
    #[must_use]
    pub fn extent(&self) -> Extent {
        let outline = footprint(self.points.iter().map(|&[x, y, _]| [x, y]));
        let density = self.points.len() as f64 / outline.area_m2;
        Extent {
            enclosing_radius_m: enclosing_radius(&outline.corners),
            hull_m2: outline.area_m2,
            density_per_m2: if outline.area_m2 > 0.0 { density } else { 0.0 },
        }
    }
}

/// Rounding allowed when a corner is tested against a circle, m.
const SLACK_M: f64 = 1e-9;

/// Radius of the smallest circle around the corners of a convex polygon. It goes through two or
/// three of them (Welzl 1991), and there are few: all are tried.
fn enclosing_radius(corners: &[[f64; 2]]) -> f64 {
    let mut best = if corners.len() < 2 { 0.0 } else { f64::INFINITY };
    let mut consider = |circle: Option<([f64; 2], f64)>| {
        if let Some((centre, radius)) = circle
            && radius < best
            && corners.iter().all(|corner| distance(*corner, centre) <= radius + SLACK_M)
        {
            best = radius;
        }
    };
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners[..i].iter().enumerate() {
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            consider(Some((middle, distance(a, middle))));
            for &c in &corners[..j] {
                consider(circumcircle(a, b, c));
            }
        }
    }
    best
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    (dx * dx + dy * dy).sqrt()
}

/// Centre and radius of the circle through three positions; none when they lie on a line.
fn circumcircle(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<([f64; 2], f64)> {
    let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let twice = 2.0 * (bx * cy - by * cx);
    if twice.abs() < 1e-12 {
        return None;
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let offset = [(cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice];
    let centre = [a[0] + offset[0], a[1] + offset[1]];
    Some((centre, distance(a, centre)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cluster(plan: &[[f64; 2]]) -> Cluster {
        let points = plan.iter().map(|&[x, y]| [x, y, x + y]).collect();
        Cluster { points, ..Cluster::default() }
    }

    #[test]
    fn circles_around_known_figures() {
        let square = cluster(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]).extent();
        assert!((square.enclosing_radius_m - 2f64.sqrt()).abs() < 1e-12);
        assert_eq!((square.hull_m2, square.density_per_m2), (4.0, 1.0));
        // An obtuse triangle: its longest side is the diameter.
        let flat = cluster(&[[0.0, 0.0], [4.0, 0.0], [2.0, 0.5]]).extent();
        assert!((flat.enclosing_radius_m - 2.0).abs() < 1e-12);
        // An acute one: its circumcircle.
        let acute = cluster(&[[0.0, 0.0], [3.0, 0.0], [1.5, 2.0]]).extent();
        assert!((acute.enclosing_radius_m - 1.5625).abs() < 1e-9);
    }

    #[test]
    fn small_clusters_have_no_area() {
        assert_eq!(cluster(&[]).extent().enclosing_radius_m, 0.0);
        assert_eq!(cluster(&[[1.0, 1.0]]).extent().density_per_m2, 0.0);
        assert_eq!(cluster(&[]).highest(), None);
        assert_eq!(cluster(&[[1.0, 1.0], [1.0, 2.0]]).highest(), Some([1.0, 2.0, 3.0]));
    }
}
