//! Extra columns: attributes known only by name and type.

use crate::Error;
use serde::{Deserialize, Serialize};

/// The values of one extra attribute, one per point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the variants are the element types")]
pub enum Column {
    U8(Vec<u8>),
    I8(Vec<i8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    U32(Vec<u32>),
    I32(Vec<i32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Applies one expression to the vector of whichever variant is there.
macro_rules! each {
    ($column:expr, $values:ident => $body:expr) => {
        match $column {
            Column::U8($values) => $body,
            Column::I8($values) => $body,
            Column::U16($values) => $body,
            Column::I16($values) => $body,
            Column::U32($values) => $body,
            Column::I32($values) => $body,
            Column::F32($values) => $body,
            Column::F64($values) => $body,
        }
    };
}

/// As `each!`, but rebuilds a column of the same type.
macro_rules! rebuild {
    ($column:expr, $values:ident => $body:expr) => {
        match $column {
            Column::U8($values) => Column::U8($body),
            Column::I8($values) => Column::I8($body),
            Column::U16($values) => Column::U16($body),
            Column::I16($values) => Column::I16($body),
            Column::U32($values) => Column::U32($body),
            Column::I32($values) => Column::I32($body),
            Column::F32($values) => Column::F32($body),
            Column::F64($values) => Column::F64($body),
        }
    };
}

impl Column {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        each!(self, values => values.len())
    }

    /// Whether there are no values.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The element type's name, `u8` to `f64`.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::U8(_) => "u8",
            Self::I8(_) => "i8",
            Self::U16(_) => "u16",
            Self::I16(_) => "i16",
            Self::U32(_) => "u32",
            Self::I32(_) => "i32",
            Self::F32(_) => "f32",
            Self::F64(_) => "f64",
        }
    }

    /// The value at an index as `f64` (exact for every type).
    #[must_use]
    #[allow(clippy::useless_conversion, reason = "one arm of the macro holds f64 already")]
    pub fn value(&self, index: usize) -> f64 {
        each!(self, values => f64::from(values[index]))
    }

    /// The values at the given indices, in their order.
    #[must_use]
    pub fn select(&self, indices: &[u32]) -> Self {
        rebuild!(self, values => indices.iter().map(|&i| values[i as usize]).collect())
    }

    /// An empty column of the same type.
    #[must_use]
    pub fn like(&self) -> Self {
        rebuild!(self, _values => Vec::new())
    }

    /// Adds zeros until there are `len` values.
    pub fn pad(&mut self, len: usize) {
        each!(self, values => values.resize(len.max(values.len()), Default::default()));
    }

    /// Appends another column of the same type.
    ///
    /// # Errors
    /// [`Error::ColumnType`] (without a name) when the types differ.
    pub fn append(&mut self, other: &Self) -> Result<(), Error> {
        match (&mut *self, other) {
            (Self::U8(a), Self::U8(b)) => a.extend_from_slice(b),
            (Self::I8(a), Self::I8(b)) => a.extend_from_slice(b),
            (Self::U16(a), Self::U16(b)) => a.extend_from_slice(b),
            (Self::I16(a), Self::I16(b)) => a.extend_from_slice(b),
            (Self::U32(a), Self::U32(b)) => a.extend_from_slice(b),
            (Self::I32(a), Self::I32(b)) => a.extend_from_slice(b),
            (Self::F32(a), Self::F32(b)) => a.extend_from_slice(b),
            (Self::F64(a), Self::F64(b)) => a.extend_from_slice(b),
            (left, right) => {
                let (left, right) = (left.type_name(), right.type_name());
                return Err(Error::ColumnType { column: String::new(), left, right });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn select_pad_append() {
        let mut column = Column::U16(vec![5, 6, 7]).select(&[2, 0]);
        column.pad(3);
        column.append(&Column::U16(vec![9])).unwrap();
        assert_eq!(column, Column::U16(vec![7, 5, 0, 9]));
    }

    #[test]
    fn types_do_not_mix() {
        assert!(Column::U8(vec![1]).append(&Column::F32(vec![1.0])).is_err());
    }
}
