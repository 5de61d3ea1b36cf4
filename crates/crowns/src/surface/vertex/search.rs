//! The line search of the vertex descent: a weighted median by quickselect.

/// Where an edge meets the zero of a residual or a bound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Break<T> {
    /// What says how far along the edge it is.
    pub(super) key: T,
    /// By how much the slope of the objective rises there; infinite at a bound.
    pub(super) rise: f64,
}

/// The first breakpoint, in the given order, up to which the slope rises to nought or more.
///
/// Where rounding lets none or all of them do so it is the first or the last; `None` without
/// breakpoints. Reorders them. The time is linear in the mean, also with many equal breakpoints
/// (heights rounded to centimetres), and it ends whatever the order is.
pub(super) fn crossing<T: Copy>(
    points: &mut [Break<T>],
    mut slope: f64,
    before: impl Fn(&T, &T) -> bool,
) -> Option<T> {
    let mut count = points.len();
    let mut last = None;
    while count > 0 {
        let pivot = middle(&points[..count], &before);
        let below = rise(&points[..count], |key| before(key, &pivot));
        if slope + below >= 0.0 {
            last = Some(pivot);
            count = keep(&mut points[..count], |key| before(key, &pivot));
            continue;
        }
        let reached = rise(&points[..count], |key| !before(&pivot, key));
        if slope + reached >= 0.0 {
            return Some(pivot);
        }
        slope += reached;
        last = Some(pivot);
        count = keep(&mut points[..count], |key| before(&pivot, key));
    }
    last
}

/// Total rise of the breakpoints that satisfy a condition, in four sums at a time.
fn rise<T: Copy>(points: &[Break<T>], counts: impl Fn(&T) -> bool) -> f64 {
    let value = |point: &Break<T>| if counts(&point.key) { point.rise } else { 0.0 };
    let mut sums = [0.0; 4];
    let (fours, rest) = points.as_chunks::<4>();
    for four in fours {
        sums.iter_mut().zip(four).for_each(|(sum, point)| *sum += value(point));
    }
    sums.iter().sum::<f64>() + rest.iter().map(value).sum::<f64>()
}

/// Moves the breakpoints that satisfy a condition to the front; how many do.
fn keep<T: Copy>(points: &mut [Break<T>], belongs: impl Fn(&T) -> bool) -> usize {
    let mut count = 0;
    for place in 0..points.len() {
        let point = points[place];
        points[count] = point;
        count += usize::from(belongs(&point.key));
    }
    count
}

/// The median of the first, the middle and the last.
fn middle<T: Copy>(points: &[Break<T>], before: &impl Fn(&T, &T) -> bool) -> T {
    let (mut a, mut c) = (points[0].key, points[points.len() - 1].key);
    let b = points[points.len() / 2].key;
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
