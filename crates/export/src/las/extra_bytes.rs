//! Extra dimensions and their description (LAS 1.4 R15, "Extra Bytes", table 24).

use crate::Error;
use timberline_pointcloud::Column;

/// Element type of an extra dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the variants are the element types")]
pub enum DimensionType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl DimensionType {
    /// The type of a column.
    #[must_use]
    pub fn of(column: &Column) -> Self {
        match column {
            Column::U8(_) => Self::U8,
            Column::I8(_) => Self::I8,
            Column::U16(_) => Self::U16,
            Column::I16(_) => Self::I16,
            Column::U32(_) => Self::U32,
            Column::I32(_) => Self::I32,
            Column::F32(_) => Self::F32,
            Column::F64(_) => Self::F64,
        }
    }

    /// Number in the standard, size in bytes and name.
    fn facts(self) -> (u8, usize, &'static str) {
        match self {
            Self::U8 => (1, 1, "u8"),
            Self::I8 => (2, 1, "i8"),
            Self::U16 => (3, 2, "u16"),
            Self::I16 => (4, 2, "i16"),
            Self::U32 => (5, 4, "u32"),
            Self::I32 => (6, 4, "i32"),
            Self::F32 => (9, 4, "f32"),
            Self::F64 => (10, 8, "f64"),
        }
    }

    /// Size in bytes.
    #[must_use]
    pub fn size(self) -> usize {
        self.facts().1
    }

    /// The type's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.facts().2
    }
}

/// An extra dimension of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dimension {
    /// Name: that of the clouds' extra column.
    pub name: String,
    /// Element type.
    pub kind: DimensionType,
    /// What it is, at most 32 bytes are kept.
    pub description: String,
}

impl Dimension {
    /// The 192 bytes that describe the dimension.
    ///
    /// # Errors
    /// [`Error::DimensionName`].
    pub fn descriptor(&self) -> Result<Vec<u8>, Error> {
        if self.name.is_empty() || self.name.len() > 32 {
            return Err(Error::DimensionName { name: self.name.clone() });
        }
        let mut bytes = vec![0; 192];
        bytes[2] = self.kind.facts().0;
        bytes[4..4 + self.name.len()].copy_from_slice(self.name.as_bytes());
        let ascii = self.description.bytes().filter(u8::is_ascii).take(32);
        bytes[160..].iter_mut().zip(ascii).for_each(|(place, byte)| *place = byte);
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_descriptor() {
        let dimension = Dimension {
            name: "treeID".into(),
            kind: DimensionType::F64,
            description: "tree of the point, 0 for none".into(),
        };
        let bytes = dimension.descriptor().unwrap();
        assert_eq!((bytes.len(), bytes[2], &bytes[4..11]), (192, 10, b"treeID\0".as_slice()));
        assert_eq!(&bytes[160..164], b"tree");
    }

    #[test]
    fn a_name_too_long_is_named() {
        let name = "n".repeat(33);
        let dimension = Dimension { name, kind: DimensionType::U8, description: String::new() };
        assert!(dimension.descriptor().unwrap_err().to_string().contains("nnn"));
    }
}
