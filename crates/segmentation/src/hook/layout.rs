//! Extra bytes of LAS records (ASPRS LAS 1.4 R15, "Extra Bytes", tables 24 and 25).

/// User id and record number of the description.
pub(super) const USER: &str = "LASF_Spec";
pub(super) const RECORD: u16 = 4;
/// Bytes of the description of one dimension.
const DESCRIPTOR: usize = 192;
/// Bits of the options that say values are scaled or moved.
const SCALE_OR_OFFSET: u8 = 0x18;

/// One extra dimension.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Dimension {
    pub(super) name: String,
    /// Number of the type in the standard.
    pub(super) kind: u8,
    /// First byte, counted from the first extra byte of a record.
    pub(super) start: usize,
    /// Whether stored values are scaled or moved.
    pub(super) is_scaled: bool,
}

/// A number of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    Whole(i128),
    Real(f64),
}

impl Number {
    pub(super) fn real(self) -> f64 {
        match self {
            Self::Whole(value) => value as f64,
            Self::Real(value) => value,
        }
    }

    /// The number without a fraction, if it has none and is no larger than a double tells exactly.
    pub(super) fn whole(self) -> Option<u64> {
        const EXACT: f64 = 9_007_199_254_740_992.0;
        match self {
            Self::Whole(value) => u64::try_from(value).ok(),
            Self::Real(value) if (0.0..=EXACT).contains(&value) && value.fract() == 0.0 => {
                Some(value as u64)
            }
            Self::Real(_) => None,
        }
    }
}

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Whole(value) => write!(f, "{value}"),
            Self::Real(value) => write!(f, "{value}"),
        }
    }
}

/// The description of a dimension, as it is written.
pub(super) fn descriptor(name: &str, kind: u8, description: &str) -> Vec<u8> {
    let mut bytes = vec![0; DESCRIPTOR];
    bytes[2] = kind;
    bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
    bytes[160..160 + description.len()].copy_from_slice(description.as_bytes());
    bytes
}

/// The dimensions a description lists. Undescribed bytes (type 0) take as many bytes as their options
/// say.
pub(super) fn dimensions(description: &[u8]) -> Vec<Dimension> {
    let mut start = 0;
    let mut found = Vec::new();
    for bytes in description.chunks_exact(DESCRIPTOR) {
        let (kind, options) = (bytes[2], bytes[3]);
        let name = bytes[4..36].split(|byte| *byte == 0).next().unwrap_or_default();
        let name = String::from_utf8_lossy(name).into_owned();
        let is_scaled = kind != 0 && options & SCALE_OR_OFFSET != 0;
        found.push(Dimension { name, kind, start, is_scaled });
        start += size(kind).unwrap_or(usize::from(options));
    }
    found
}

/// Bytes of a type; `None` for those that are no single number.
fn size(kind: u8) -> Option<usize> {
    match kind {
        1 | 2 => Some(1),
        3 | 4 => Some(2),
        5 | 6 | 9 => Some(4),
        7 | 8 | 10 => Some(8),
        _ => None,
    }
}

/// The value of a dimension in the extra bytes of a record.
pub(super) fn value(dimension: &Dimension, extra: &[u8]) -> Option<Number> {
    let bytes = extra.get(dimension.start..dimension.start + size(dimension.kind)?)?;
    fn cut<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
        bytes.try_into().ok()
    }
    let whole = |value: i128| Some(Number::Whole(value));
    match dimension.kind {
        1 => whole(u8::from_le_bytes(cut(bytes)?).into()),
        2 => whole(i8::from_le_bytes(cut(bytes)?).into()),
        3 => whole(u16::from_le_bytes(cut(bytes)?).into()),
        4 => whole(i16::from_le_bytes(cut(bytes)?).into()),
        5 => whole(u32::from_le_bytes(cut(bytes)?).into()),
        6 => whole(i32::from_le_bytes(cut(bytes)?).into()),
        7 => whole(u64::from_le_bytes(cut(bytes)?).into()),
        8 => whole(i64::from_le_bytes(cut(bytes)?).into()),
        9 => Some(Number::Real(f32::from_le_bytes(cut(bytes)?).into())),
        10 => Some(Number::Real(f64::from_le_bytes(cut(bytes)?))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dimensions_lie_one_behind_the_other() {
        let text = [descriptor("a", 3, ""), descriptor("tree_id", 8, "x")].concat();
        let found = dimensions(&text);
        assert_eq!((found[1].name.as_str(), found[1].start), ("tree_id", 2));
        let extra = [&[9, 9][..], &(-5_i64).to_le_bytes()].concat();
        assert_eq!(value(&found[1], &extra), Some(Number::Whole(-5)));
        assert_eq!(value(&found[1], &extra[..9]), None, "cut short");
    }

    #[test]
    fn whole_numbers() {
        assert_eq!(Number::Real(7.0).whole(), Some(7));
        for wrong in [Number::Real(7.5), Number::Real(f64::NAN), Number::Whole(-1)] {
            assert_eq!(wrong.whole(), None, "{wrong}");
        }
        assert_eq!(Number::Whole(u64::MAX.into()).whole(), Some(u64::MAX));
    }
}
