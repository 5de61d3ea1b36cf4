//! Colours and ramps.

/// Red, green and blue, 0 to 255.
pub type Rgb = [u8; 3];

/// Black-ish for text and outlines.
pub const INK: Rgb = [33, 37, 41];
/// Grey for axes and notes.
pub const GREY: Rgb = [110, 116, 122];
/// Page.
pub const PAPER: Rgb = [255, 255, 255];
/// Where a map has no data.
pub const NO_DATA: Rgb = [238, 240, 242];

/// A ramp: colours at evenly spaced places from 0 to 1, in between linear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ramp(&'static [Rgb]);

/// Viridis (van der Walt and Smith 2015, matplotlib, CC0) at every sixteenth: readable with any
/// colour vision and in print.
pub const VIRIDIS: Ramp = Ramp(&[
    [68, 1, 84],
    [72, 26, 108],
    [71, 47, 125],
    [65, 68, 135],
    [57, 86, 140],
    [49, 104, 142],
    [42, 120, 142],
    [35, 136, 142],
    [31, 152, 139],
    [34, 168, 132],
    [53, 183, 121],
    [84, 197, 104],
    [122, 209, 81],
    [165, 219, 54],
    [210, 226, 27],
    [241, 229, 29],
    [253, 231, 37],
]);

/// Cividis (Nunez, Anderton and Renslow 2018, PLoS ONE 13(7), CC BY) at every eighth: for elevations.
pub const CIVIDIS: Ramp = Ramp(&[
    [0, 34, 78],
    [27, 53, 112],
    [64, 77, 107],
    [96, 99, 110],
    [124, 123, 120],
    [156, 148, 120],
    [188, 175, 111],
    [222, 203, 92],
    [254, 232, 56],
]);

impl Ramp {
    /// The colour at a place from 0 to 1; beyond, that of the end. NaN is [`NO_DATA`].
    #[must_use]
    pub fn at(&self, place: f64) -> Rgb {
        if place.is_nan() {
            return NO_DATA;
        }
        let last = self.0.len() - 1;
        let scaled = place.clamp(0.0, 1.0) * last as f64;
        let left = (scaled.floor() as usize).min(last.saturating_sub(1));
        mix(self.0[left], self.0[(left + 1).min(last)], scaled - left as f64)
    }
}

/// A colour between two: `share` 0 is the first, 1 the second.
#[must_use]
pub fn mix(first: Rgb, second: Rgb, share: f64) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    std::array::from_fn(|i| {
        (f64::from(first[i]) * (1.0 - share) + f64::from(second[i]) * share).round() as u8
    })
}

/// A colour in the light of a shading from 0 to 1.
#[must_use]
pub fn lit(colour: Rgb, light: f64) -> Rgb {
    colour.map(|channel| (f64::from(channel) * light.clamp(0.0, 1.0)).round() as u8)
}

/// The colour and name of an ASPRS class, from the palette of Okabe and Ito (2008), which is
/// readable with any colour vision.
#[must_use]
pub fn class(code: u8) -> (Rgb, &'static str) {
    match code {
        0 | 1 => ([153, 153, 153], "unclassified"),
        2 => ([148, 96, 40], "ground"),
        3 => ([214, 208, 90], "low vegetation"),
        4 => ([86, 180, 130], "medium vegetation"),
        5 => ([0, 110, 70], "high vegetation"),
        6 => ([213, 94, 0], "building"),
        7 | 18 => ([204, 20, 120], "noise"),
        9 => ([0, 114, 178], "water"),
        12 => ([204, 121, 167], "overlap"),
        _ => ([230, 159, 0], "other"),
    }
}

/// A colour for a tree id: neighbours differ, the same id is always the same.
#[must_use]
pub fn of_id(id: u64) -> Rgb {
    /// Tol's "muted" scheme (2021), made for categories.
    const COLOURS: [Rgb; 9] = [
        [204, 102, 119],
        [51, 34, 136],
        [221, 204, 119],
        [17, 119, 51],
        [136, 204, 238],
        [136, 34, 85],
        [68, 170, 153],
        [153, 153, 51],
        [170, 68, 153],
    ];
    // Fibonacci hashing (Knuth, The Art of Computer Programming 3, section 6.4).
    let place = id.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
    COLOURS[place as usize % COLOURS.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_between() {
        assert_eq!(
            [VIRIDIS.at(-1.0), VIRIDIS.at(0.0), VIRIDIS.at(2.0)],
            [[68, 1, 84], [68, 1, 84], [253, 231, 37]]
        );
        assert_eq!(VIRIDIS.at(1.5 / 16.0), [72, 37, 117]);
        assert_eq!(VIRIDIS.at(f64::NAN), NO_DATA);
    }

    #[test]
    fn light_grows_along_the_ramps() {
        let luminance =
            |[r, g, b]: Rgb| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        for ramp in [VIRIDIS, CIVIDIS] {
            let light: Vec<f64> =
                (0..=50).map(|i| luminance(ramp.at(f64::from(i) / 50.0))).collect();
            assert!(light.windows(2).all(|pair| pair[1] > pair[0]));
        }
    }
}
