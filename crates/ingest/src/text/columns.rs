//! What the columns of a text file are: by their names, or by how many there are.

use super::dialect::Dialect;
use crate::assemble::Scaling;
use crate::attributes::{Role, roles_of};

/// What is known of the values of one column from samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub(crate) min: f64,
    pub(crate) max: f64,
    /// Whether all are whole numbers.
    pub(crate) whole: bool,
    /// Values that are numbers.
    pub(crate) numbers: u64,
    /// Values that are none.
    pub(crate) others: u64,
}

impl Range {
    pub(crate) const NOTHING: Self =
        Self { min: f64::INFINITY, max: f64::NEG_INFINITY, whole: true, numbers: 0, others: 0 };

    /// The range of values that are all numbers.
    pub(crate) fn of(values: &[f64]) -> Self {
        let mut range = Self::NOTHING;
        values.iter().for_each(|value| range.add(Some(*value)));
        range
    }

    pub(crate) fn add(&mut self, value: Option<f64>) {
        match value {
            Some(value) if value.is_finite() => {
                self.min = self.min.min(value);
                self.max = self.max.max(value);
                self.whole &= value.fract() == 0.0;
                self.numbers += 1;
            }
            Some(_) => {}
            None => self.others += 1,
        }
    }

    fn is_whole_within(&self, min: f64, max: f64) -> bool {
        self.whole && self.min >= min && self.max <= max
    }
}

/// The roles of a file's columns; `None` for those that hold text.
pub(crate) fn roles(
    dialect: &Dialect,
    ranges: &[Range],
    notes: &mut Vec<String>,
) -> Vec<Option<Role>> {
    let mut names = match &dialect.names {
        Some(names) => names.clone(),
        None => by_width(dialect.width, ranges, notes),
    };
    names.extend((names.len()..dialect.width).map(|index| format!("column_{}", index + 1)));
    let mut roles = roles_of(names.iter().map(String::as_str));
    for ((role, range), name) in roles.iter_mut().zip(ranges).zip(&names) {
        let is_text = range.others > range.numbers && !matches!(role, Some(Role::Axis(_)));
        if is_text {
            notes.push(format!("column `{}` holds text and is left out", name.trim()));
            *role = None;
        }
    }
    roles
}

/// Names for rows without a header: 3 values are x y z, 4 have an intensity, 6 a colour, 7 both.
fn by_width(width: usize, ranges: &[Range], notes: &mut Vec<String>) -> Vec<String> {
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let is_colour = |from: usize| {
        ranges
            .get(from..from + 3)
            .is_some_and(|ranges| ranges.iter().all(|range| range.is_whole_within(0.0, 65_535.0)))
    };
    match width {
        4 => names(&["x", "y", "z", "intensity"]),
        6 if is_colour(3) => names(&["x", "y", "z", "red", "green", "blue"]),
        7 if is_colour(4) => names(&["x", "y", "z", "intensity", "red", "green", "blue"]),
        3 => names(&["x", "y", "z"]),
        _ => {
            notes.push(format!(
                "nothing names the {} columns after x, y, z: they are kept as column_4 and so on",
                width.saturating_sub(3)
            ));
            names(&["x", "y", "z"])
        }
    }
}

/// How intensities become 16 bits, and what to say about it. `None` when they fit as they are.
///
/// Whole numbers from 0 to 65,535 fit. PTS has them from -2048 to 2047 (Leica Cyclone), others from
/// 0 to 1; anything else is taken to span the range seen.
pub(crate) fn intensity(range: &Range) -> Option<(Scaling, String)> {
    if range.numbers == 0 || range.is_whole_within(0.0, 65_535.0) {
        return None;
    }
    let (min, max) = match range {
        range if range.is_whole_within(-2048.0, 2047.0) => (-2048.0, 2047.0),
        range if range.min >= 0.0 && range.max <= 1.0 => (0.0, 1.0),
        range => (range.min, range.max),
    };
    let said = format!(
        "intensities from {min} to {max} become 0 to 65535; as given they are in `intensity_as_given`"
    );
    Some((Scaling::range(min, max), said))
}

/// How colours become 16 bits.
pub(crate) fn colour(ranges: &[&Range]) -> Scaling {
    let max = ranges.iter().map(|range| range.max).fold(0.0, f64::max);
    let whole = ranges.iter().all(|range| range.whole);
    match max {
        max if !whole && max <= 1.0 => Scaling::range(0.0, 1.0),
        max if max <= 255.0 => Scaling::BYTE,
        _ => Scaling::NONE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(values: &[f64]) -> Range {
        Range::of(values)
    }

    #[test]
    fn intensities_that_fit_stay() {
        assert_eq!(intensity(&range(&[0.0, 255.0])), None);
        assert_eq!(intensity(&range(&[])), None);
        let scaling = |values: &[f64]| intensity(&range(values)).unwrap().0;
        assert_eq!(scaling(&[-900.0, 12.0]), Scaling::range(-2048.0, 2047.0));
        assert_eq!(scaling(&[0.25, 0.5]), Scaling::range(0.0, 1.0));
        assert_eq!(scaling(&[-22.5, 3.0]), Scaling::range(-22.5, 3.0));
    }

    #[test]
    fn normals_are_no_colours() {
        let mut notes = Vec::new();
        let xyz = [range(&[1.0]); 3];
        let with = |values: [f64; 3]| [&xyz[..], &values.map(|v| range(&[v]))].concat();
        assert_eq!(by_width(6, &with([0.0, 255.0, 7.0]), &mut notes)[3], "red");
        assert!(notes.is_empty());
        assert_eq!(by_width(6, &with([0.1, -0.9, 0.2]), &mut notes).len(), 3);
        assert_eq!(notes.len(), 1);
    }

    #[test]
    fn colours_of_eight_bits_become_sixteen() {
        assert_eq!(colour(&[&range(&[0.0, 255.0])]), Scaling::BYTE);
        assert_eq!(colour(&[&range(&[0.0, 256.0])]), Scaling::NONE);
        assert_eq!(colour(&[&range(&[0.5])]), Scaling::range(0.0, 1.0));
    }
}
