//! The line search of the vertex descent: a weighted median by quickselect.

/// Where an edge meets the zero of a residual or a bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Break {
    /// Distance along the edge.
    pub(super) t: f64,
    /// By how much the slope of the objective rises there; infinite at a bound.
    pub(super) rise: f64,
    /// The row or bound.
    pub(super) at: usize,
}

/// The first place, in the given order, up to which the slope rises to nought or more.
///
/// Reorders the breakpoints so that those in front of the returned place come before it. The last
/// one where rounding keeps the slope negative; `None` without breakpoints. The time is linear: the
/// order need not be total, and many equal breakpoints (heights rounded to centimetres) do no harm.
pub(super) fn crossing(
    points: &mut [Break],
    mut slope: f64,
    before: impl Fn(&Break, &Break) -> bool,
) -> Option<usize> {
    let (mut low, mut high) = (0, points.len());
    while high - low > 1 {
        let pivot = middle(&points[low..high], &before);
        let (mut split, rise) = partition(&mut points[low..high], |point| before(point, &pivot));
        if split > 0 && slope + rise >= 0.0 {
            high = low + split;
            continue;
        }
        slope += rise;
        low += split;
        // The pivot and its equals.
        let (equal, rise) = partition(&mut points[low..high], |point| !before(&pivot, point));
        split = low + equal;
        if slope + rise >= 0.0 {
            return first_of_equals(&points[low..split], slope).map(|place| low + place);
        }
        slope += rise;
        low = split;
    }
    if low < high { Some(low) } else { points.len().checked_sub(1) }
}

fn first_of_equals(points: &[Break], mut slope: f64) -> Option<usize> {
    let crosses = |point: &Break| {
        slope += point.rise;
        slope >= 0.0
    };
    points.iter().position(crosses).or(points.len().checked_sub(1))
}

/// Moves the breakpoints that satisfy a condition to the front; their number and total rise.
fn partition(points: &mut [Break], first: impl Fn(&Break) -> bool) -> (usize, f64) {
    let (mut split, mut rise) = (0, 0.0);
    for place in 0..points.len() {
        let point = points[place];
        let belongs = first(&point);
        points[place] = points[split];
        points[split] = point;
        rise += if belongs { point.rise } else { 0.0 };
        split += usize::from(belongs);
    }
    (split, rise)
}

/// The median of the first, the middle and the last.
fn middle(points: &[Break], before: &impl Fn(&Break, &Break) -> bool) -> Break {
    let (mut a, b, mut c) = (points[0], points[points.len() / 2], points[points.len() - 1]);
    if before(&c, &a) {
        (a, c) = (c, a);
    }
    if before(&b, &a) {
        a
    } else if before(&c, &b) {
        c
    } else {
        b
    }
}
