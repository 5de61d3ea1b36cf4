//! Which values of a scan become what.

use super::pose::Pose;
use crate::attributes::Role;
use ::e57::{PointCloud, RecordDataType, RecordName, RecordValue};
use std::collections::BTreeSet;
use timberline_pointcloud::Column;

/// Largest value of intensities and colours, which have 16 bits.
const FULL: f64 = 65_535.0;
/// Further attributes of scans that are kept.
const MAX_EXTRA: usize = 64;

/// A column that a file has: attributes that any of its scans has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Attribute {
    Axis(usize),
    Intensity,
    Colour(usize),
    ReturnNumber,
    NumberOfReturns,
    Time,
    Row,
    ColumnIndex,
    Other(String),
}

impl Attribute {
    pub(super) fn role(&self) -> Role {
        match self {
            Self::Axis(axis) => Role::Axis(*axis),
            Self::Intensity => Role::Intensity,
            Self::Colour(index) => Role::Colour(*index),
            Self::ReturnNumber => Role::ReturnNumber,
            Self::NumberOfReturns => Role::NumberOfReturns,
            Self::Time => Role::GpsTime,
            Self::Row => Role::Extra("row_index".to_owned()),
            Self::ColumnIndex => Role::Extra("column_index".to_owned()),
            Self::Other(name) => Role::Extra(name.clone()),
        }
    }

    fn of(name: &RecordName) -> Option<Self> {
        Some(match name {
            RecordName::Intensity => Self::Intensity,
            RecordName::ColorRed => Self::Colour(0),
            RecordName::ColorGreen => Self::Colour(1),
            RecordName::ColorBlue => Self::Colour(2),
            RecordName::ReturnIndex => Self::ReturnNumber,
            RecordName::ReturnCount => Self::NumberOfReturns,
            RecordName::TimeStamp => Self::Time,
            RecordName::RowIndex => Self::Row,
            RecordName::ColumnIndex => Self::ColumnIndex,
            RecordName::Unknown { name, .. } => Self::Other(name.clone()),
            _ => return None,
        })
    }

    /// Values as they are kept.
    pub(super) fn column(&self, values: Vec<f64>) -> Column {
        match self {
            Self::Row | Self::ColumnIndex => {
                Column::I32(values.into_iter().map(|value| value as i32).collect())
            }
            _ => Column::F64(values),
        }
    }

    /// The value of points whose scan has no such attribute.
    fn missing(&self) -> f64 {
        if *self == Self::Time { f64::NAN } else { 0.0 }
    }
}

/// The attributes of all scans, coordinates first, each once.
pub(super) fn file_roles(scans: &[PointCloud]) -> Vec<Attribute> {
    let mut all = vec![Attribute::Axis(0), Attribute::Axis(1), Attribute::Axis(2)];
    let mut others = BTreeSet::new();
    for record in scans.iter().flat_map(|scan| &scan.prototype) {
        match Attribute::of(&record.name) {
            Some(Attribute::Other(name)) => drop(others.insert(name)),
            Some(attribute) if !all.contains(&attribute) => all.push(attribute),
            _ => {}
        }
    }
    let taken = ["red", "green", "blue", "row_index", "column_index"];
    let others = others.into_iter().filter(|name| !taken.contains(&name.as_str()));
    all.extend(others.take(MAX_EXTRA).map(Attribute::Other));
    all
}

/// How values are taken from the records of one scan.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    types: Vec<RecordDataType>,
    cartesian: Option<[usize; 3]>,
    spherical: Option<[usize; 3]>,
    cartesian_invalid: Option<usize>,
    spherical_invalid: Option<usize>,
    pose: Pose,
    others: Vec<Getter>,
}

/// One attribute of a scan.
#[derive(Debug, Clone)]
struct Getter {
    /// Its record; `None` in scans without it.
    at: Option<usize>,
    /// The record that says whether it is invalid.
    invalid: Option<usize>,
    zero: f64,
    factor: f64,
    missing: f64,
}

impl Layout {
    /// The layout of a scan for the columns of its file, and what is to be said about it.
    ///
    /// # Errors
    /// Why no point of it can be read.
    pub(super) fn of(
        scan: &PointCloud,
        columns: &[Attribute],
    ) -> Result<(Self, Vec<String>), String> {
        use RecordName as N;
        let find = |name: &RecordName| scan.prototype.iter().position(|r| r.name == *name);
        let three = |names: [RecordName; 3]| {
            let [a, b, c] = names.map(|name| find(&name));
            Some([a?, b?, c?])
        };
        let cartesian = three([N::CartesianX, N::CartesianY, N::CartesianZ]);
        let spherical = three([N::SphericalRange, N::SphericalAzimuth, N::SphericalElevation]);
        if cartesian.is_none() && spherical.is_none() {
            return Err("it has neither Cartesian nor spherical coordinates".to_owned());
        }
        // The crate cannot tell how many points there are when no value takes a bit.
        if scan.prototype.iter().all(|record| is_constant(&record.data_type)) {
            return Err("all values of all points are declared to be the same".to_owned());
        }
        let (pose, said) = Pose::of(scan.transform.as_ref());
        let layout = Self {
            types: scan.prototype.iter().map(|record| record.data_type.clone()).collect(),
            cartesian,
            spherical,
            cartesian_invalid: find(&N::CartesianInvalidState),
            spherical_invalid: find(&N::SphericalInvalidState),
            pose,
            others: columns[3..].iter().map(|column| getter(scan, column)).collect(),
        };
        Ok((layout, said.into_iter().collect()))
    }

    fn value(&self, values: &[RecordValue], at: usize) -> f64 {
        match (&values[at], &self.types[at]) {
            (RecordValue::Single(value), _) => f64::from(*value),
            (RecordValue::Double(value), _) => *value,
            (
                RecordValue::ScaledInteger(value),
                RecordDataType::ScaledInteger { scale, offset, .. },
            ) => *value as f64 * scale + offset,
            (RecordValue::ScaledInteger(value) | RecordValue::Integer(value), _) => *value as f64,
        }
    }

    fn is_valid(&self, values: &[RecordValue], state: Option<usize>) -> bool {
        state.is_none_or(|at| self.value(values, at) == 0.0)
    }

    /// The position in the frame of the file, metres; `None` for points marked as invalid.
    pub(super) fn position(&self, values: &[RecordValue]) -> Option<[f64; 3]> {
        let get = |places: [usize; 3]| places.map(|at| self.value(values, at));
        if let Some(places) =
            self.cartesian.filter(|_| self.is_valid(values, self.cartesian_invalid))
        {
            return Some(self.pose.apply(get(places)));
        }
        let places = self.spherical.filter(|_| self.is_valid(values, self.spherical_invalid))?;
        let [range_m, azimuth, elevation] = get(places);
        let (sin_a, cos_a) = libm::sincos(azimuth);
        let (sin_e, cos_e) = libm::sincos(elevation);
        let across_m = range_m * cos_e;
        Some(self.pose.apply([across_m * cos_a, across_m * sin_a, range_m * sin_e]))
    }

    /// Appends the other attributes of a point to their columns.
    pub(super) fn others(&self, values: &[RecordValue], columns: &mut [Vec<f64>]) {
        for (getter, column) in self.others.iter().zip(columns) {
            let at = getter.at.filter(|_| self.is_valid(values, getter.invalid));
            column.push(at.map_or(getter.missing, |at| {
                (self.value(values, at) - getter.zero) * getter.factor
            }));
        }
    }
}

fn is_constant(kind: &RecordDataType) -> bool {
    match kind {
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            min == max
        }
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => false,
    }
}

fn getter(scan: &PointCloud, column: &Attribute) -> Getter {
    let of = |record: &::e57::Record| Attribute::of(&record.name).as_ref() == Some(column);
    let at = scan.prototype.iter().position(of);
    let find = |name: RecordName| scan.prototype.iter().position(|r| r.name == name);
    let invalid = match column {
        Attribute::Intensity => find(RecordName::IsIntensityInvalid),
        Attribute::Colour(_) => find(RecordName::IsColorInvalid),
        Attribute::Time => find(RecordName::IsTimeStampInvalid),
        _ => None,
    };
    let (zero, factor) = match column {
        Attribute::Intensity | Attribute::Colour(_) => {
            to_sixteen_bits(at.and_then(|at| limits(scan, at, column)))
        }
        // Zero-based in E57 (ASTM E2807, table 9), from 1 in a point.
        Attribute::ReturnNumber => (-1.0, 1.0),
        _ => (0.0, 1.0),
    };
    Getter { at, invalid, zero, factor, missing: column.missing() }
}

/// What maps a range to 0 to 65,535; values of unknown range stay as they are.
fn to_sixteen_bits(limits: Option<(f64, f64)>) -> (f64, f64) {
    let usable = limits.filter(|(min, max)| min.is_finite() && max.is_finite() && max > min);
    usable.map_or((0.0, 1.0), |(min, max)| (min, FULL / (max - min)))
}

/// The limits of an intensity or colour: as stated for the scan, else those of the type.
fn limits(scan: &PointCloud, at: usize, column: &Attribute) -> Option<(f64, f64)> {
    let kind = &scan.prototype[at].data_type;
    let number = |value: &Option<RecordValue>| value.as_ref()?.to_f64(kind).ok();
    let colour = scan.color_limits.as_ref();
    let stated = match column {
        Attribute::Intensity => {
            scan.intensity_limits.as_ref().map(|l| (&l.intensity_min, &l.intensity_max))
        }
        Attribute::Colour(0) => colour.map(|l| (&l.red_min, &l.red_max)),
        Attribute::Colour(1) => colour.map(|l| (&l.green_min, &l.green_max)),
        _ => colour.map(|l| (&l.blue_min, &l.blue_max)),
    };
    let of_type = match kind {
        RecordDataType::Single { min, max } => min.map(f64::from).zip(max.map(f64::from)),
        RecordDataType::Double { min, max } => min.zip(*max),
        RecordDataType::Integer { min, max } => Some((*min as f64, *max as f64)),
        RecordDataType::ScaledInteger { min, max, scale, offset } => {
            Some((*min as f64 * scale + offset, *max as f64 * scale + offset))
        }
    };
    stated.and_then(|(min, max)| number(min).zip(number(max))).or(of_type)
}
