//! Points from columns of values.

use crate::attributes::{COLOURS, Role};
use timberline_artefact::Crs;
use timberline_pointcloud::frame::{MAX_COORDINATE_M, ticks_from_world, world_from_ticks};
use timberline_pointcloud::{Column, PointCloud};

/// Largest value of intensities and colours, which have 16 bits.
const FULL: f64 = 65_535.0;

/// What is in front of the number of a record in messages, and the numbers.
#[derive(Debug, Clone)]
pub(crate) enum Numbers {
    /// Consecutive from this on.
    From(u64),
    /// One for each row.
    Each(Vec<u64>),
}

/// Rows of a file as columns, one for each role.
#[derive(Debug, Clone)]
pub(crate) struct Batch {
    pub(crate) columns: Vec<Column>,
    /// `record`, `line` or `scan 2, record`.
    pub(crate) noun: String,
    pub(crate) numbers: Numbers,
    /// Goes to the points' source id.
    pub(crate) source_id: u16,
}

/// 16-bit value = (value - `zero`) x `factor`, rounded, held between 0 and 65,535.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scaling {
    pub(crate) zero: f64,
    pub(crate) factor: f64,
}

impl Scaling {
    pub(crate) const NONE: Self = Self { zero: 0.0, factor: 1.0 };
    /// From 8 bits to 16: 255 becomes 65,535 (LAS 1.4-R15, section 2.6.2: colours are normalised).
    pub(crate) const BYTE: Self = Self { zero: 0.0, factor: 257.0 };

    /// From a range to all 16 bits; nothing is scaled when there is no range.
    pub(crate) fn range(min: f64, max: f64) -> Self {
        let factor = FULL / (max - min);
        if factor.is_finite() && factor > 0.0 && min.is_finite() {
            Self { zero: min, factor }
        } else {
            Self::NONE
        }
    }

    fn apply(self, value: f64) -> u16 {
        // The cast saturates, and makes 0 of NaN.
        ((value - self.zero) * self.factor + 0.5) as u16
    }
}

/// Turns batches of one file into points in the world, in metres.
#[derive(Debug, Clone)]
pub(crate) struct Assembler {
    pub(crate) roles: Vec<Role>,
    pub(crate) metres: [f64; 3],
    pub(crate) intensity: Scaling,
    pub(crate) colour: Scaling,
    /// Rows so far.
    pub(crate) read: u64,
    /// Rows so far whose coordinates cannot be used, and the first of them.
    pub(crate) outside: u64,
    pub(crate) first_outside: Option<String>,
}

impl Assembler {
    pub(crate) fn new(roles: Vec<Role>, crs: &Crs) -> Self {
        let (h, v) = (crs.horizontal_m_per_unit, crs.vertical_m_per_unit);
        Self {
            roles,
            metres: [h, h, v],
            intensity: Scaling::NONE,
            colour: Scaling::NONE,
            read: 0,
            outside: 0,
            first_outside: None,
        }
    }

    /// The points of a batch in the frame of the world (origin 0).
    pub(crate) fn points(&mut self, batch: Batch) -> PointCloud {
        let rows = batch.columns.first().map_or(0, Column::len);
        self.read += rows as u64;
        let mut cloud = PointCloud {
            intensity: vec![0; rows],
            return_number: vec![0; rows],
            number_of_returns: vec![0; rows],
            classification: vec![0; rows],
            flags: vec![0; rows],
            scan_angle_deg: vec![0.0; rows],
            gps_time: vec![f64::NAN; rows],
            source_id: vec![batch.source_id; rows],
            ..PointCloud::default()
        };
        let unusable = self.place(&mut cloud, &batch);
        for (role, column) in self.roles.iter().zip(batch.columns) {
            self.fill(&mut cloud, role, column);
        }
        if unusable.is_empty() {
            return cloud;
        }
        let mut skip = unusable.into_iter().peekable();
        let keep: Vec<u32> =
            (0..rows as u32).filter(|row| skip.next_if_eq(row).is_none()).collect();
        cloud.select(&keep)
    }

    /// Sets the positions; the rows whose positions cannot be used, ascending.
    fn place(&mut self, cloud: &mut PointCloud, batch: &Batch) -> Vec<u32> {
        let mut unusable = Vec::new();
        for (role, column) in self.roles.iter().zip(&batch.columns) {
            let Role::Axis(axis) = *role else { continue };
            let values = on_lattice(column, self.metres[axis]);
            let bad = (0..values.len() as u32).filter(|row| values[*row as usize].is_nan());
            let before = unusable.len();
            unusable.extend(bad);
            if self.first_outside.is_none() && unusable.len() > before {
                let row = unusable[before] as usize;
                self.first_outside = Some(name_value(batch, row, axis, column.value(row)));
            }
            match axis {
                0 => cloud.x = values,
                1 => cloud.y = values,
                _ => cloud.z = values,
            }
        }
        unusable.sort_unstable();
        unusable.dedup();
        self.outside += unusable.len() as u64;
        unusable
    }

    fn fill(&self, cloud: &mut PointCloud, role: &Role, column: Column) {
        let bytes = |column: &Column| each(column, |value| (value + 0.5) as u8);
        match role {
            Role::Axis(_) => {}
            Role::Intensity => cloud.intensity = sixteen_bits(column, self.intensity),
            Role::ReturnNumber => cloud.return_number = bytes(&column),
            Role::NumberOfReturns => cloud.number_of_returns = bytes(&column),
            Role::Classification => cloud.classification = bytes(&column),
            Role::ScanAngle => cloud.scan_angle_deg = each(&column, |value| value as f32),
            Role::GpsTime => cloud.gps_time = each(&column, |value| value),
            Role::SourceId => cloud.source_id = sixteen_bits(column, Scaling::NONE),
            Role::Colour(index) => {
                let values = Column::U16(sixteen_bits(column, self.colour));
                cloud.extra.insert(COLOURS[*index].to_owned(), values);
            }
            Role::Extra(name) => {
                cloud.extra.insert(name.clone(), column);
            }
        }
    }
}

fn name_value(batch: &Batch, row: usize, axis: usize, value: f64) -> String {
    let number = match &batch.numbers {
        Numbers::From(first) => first + row as u64,
        Numbers::Each(numbers) => numbers.get(row).copied().unwrap_or_default(),
    };
    format!("{} {number}: {} is {value}", batch.noun, ["x", "y", "z"][axis])
}

fn each<T>(column: &Column, to: impl Fn(f64) -> T) -> Vec<T> {
    match column {
        Column::F64(values) => values.iter().map(|value| to(*value)).collect(),
        Column::F32(values) => values.iter().map(|value| to(f64::from(*value))).collect(),
        Column::U8(values) => values.iter().map(|value| to(f64::from(*value))).collect(),
        other => (0..other.len()).map(|row| to(other.value(row))).collect(),
    }
}

fn sixteen_bits(column: Column, scaling: Scaling) -> Vec<u16> {
    match column {
        Column::U16(values) if scaling == Scaling::NONE => values,
        other => each(&other, |value| scaling.apply(value)),
    }
}

/// World coordinates on the lattice, metres; NaN for what it cannot hold.
fn on_lattice(column: &Column, metres: f64) -> Vec<f64> {
    each(column, |value| {
        let world = value * metres;
        if world.abs() <= MAX_COORDINATE_M {
            world_from_ticks(ticks_from_world(world))
        } else {
            f64::NAN
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_without_a_place_are_left_out_and_the_first_is_named() {
        let roles = vec![Role::Axis(0), Role::Axis(2), Role::Axis(1), Role::Extra("d".into())];
        let mut assembler = Assembler::new(roles, &Crs::default());
        let batch = Batch {
            columns: vec![
                Column::F32(vec![1.0, f32::NAN, 3.0, 4.0]),
                Column::F64(vec![9.0, 9.0, f64::INFINITY, 9.00004]),
                Column::I16(vec![1, 2, 3, -4]),
                Column::U8(vec![1, 2, 3, 4]),
            ],
            noun: "record".into(),
            numbers: Numbers::From(100),
            source_id: 7,
        };
        let cloud = assembler.points(batch);
        cloud.validate().unwrap();
        assert_eq!(cloud.world(1), [4.0, -4.0, 9.0]);
        assert_eq!(cloud.extra["d"], Column::U8(vec![1, 4]));
        assert_eq!((cloud.source_id[0], assembler.read, assembler.outside), (7, 4, 2));
        assert_eq!(assembler.first_outside.as_deref(), Some("record 101: x is NaN"));
    }

    #[test]
    fn scalings_hold_values_within_sixteen_bits() {
        let byte = |value: f64| Scaling::BYTE.apply(value);
        assert_eq!([byte(0.0), byte(255.0), byte(300.0), byte(-1.0)], [0, 65_535, 65_535, 0]);
        let scaling = Scaling::range(-2048.0, 2047.0);
        assert_eq!([scaling.apply(-2048.0), scaling.apply(2047.0)], [0, 65_535]);
        assert_eq!(Scaling::range(3.0, 3.0), Scaling::NONE);
        assert_eq!(Scaling::range(f64::NAN, 3.0), Scaling::NONE);
        assert_eq!(Scaling::NONE.apply(f64::NAN), 0);
    }
}
