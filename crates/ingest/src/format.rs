//! Layout of the point data record formats 0 to 10.
//!
//! ASPRS LAS 1.4-R15, tables 7 to 17. All values are little-endian.

/// Where the fields of one point format stand in its record, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Point data record format, 0 to 10.
    pub format: u8,
    /// Bytes of the fields the specification names; extra bytes follow.
    pub len: u16,
    /// Whether return numbers, flags and classes are those of formats 6 and up.
    pub extended: bool,
    /// GPS time, `f64`.
    pub gps_time: Option<usize>,
    /// Red, green, blue, three `u16`.
    pub rgb: Option<usize>,
    /// Near infrared, `u16`.
    pub nir: Option<usize>,
    /// Wave packet descriptor.
    pub waveform: Option<usize>,
}

/// Bytes 0 to 3, 4 to 7 and 8 to 11 hold x, y and z as `i32` in every format.
pub(crate) const XYZ: [usize; 3] = [0, 4, 8];
/// Bytes 12 and 13 hold the intensity in every format.
pub(crate) const INTENSITY: usize = 12;
/// Byte 17 holds the user data in every format.
pub(crate) const USER_DATA: usize = 17;

impl Layout {
    /// The layout of a format; `None` above 10.
    #[must_use]
    pub fn of(format: u8) -> Option<Self> {
        let (len, gps_time, rgb, nir, waveform) = match format {
            0 => (20, None, None, None, None),
            1 => (28, Some(20), None, None, None),
            2 => (26, None, Some(20), None, None),
            3 => (34, Some(20), Some(28), None, None),
            4 => (57, Some(20), None, None, Some(28)),
            5 => (63, Some(20), Some(28), None, Some(34)),
            6 => (30, Some(22), None, None, None),
            7 => (36, Some(22), Some(30), None, None),
            8 => (38, Some(22), Some(30), Some(36), None),
            9 => (59, Some(22), None, None, Some(30)),
            10 => (67, Some(22), Some(30), Some(36), Some(38)),
            _ => return None,
        };
        Some(Self { format, len, extended: format >= 6, gps_time, rgb, nir, waveform })
    }

    /// Where the point source id stands.
    #[must_use]
    pub fn source_id(&self) -> usize {
        if self.extended { 20 } else { 18 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_those_of_the_las_crate() {
        for format in 0..=10 {
            let theirs = las::point::Format::new(format).unwrap();
            assert_eq!(Layout::of(format).unwrap().len, theirs.len(), "format {format}");
        }
        assert_eq!(Layout::of(11), None);
    }
}
