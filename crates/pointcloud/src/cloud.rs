//! The column store of points.

use crate::{Bounds3, Column, Error, Frame, order};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The attributes of one point besides its position, with the meaning LAS gives them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// Strength of the echo, in the sensor's own scale.
    pub intensity: u16,
    /// Which return of its pulse, from 1; 0 where the file does not say.
    pub return_number: u8,
    /// Number of returns of the pulse; 0 where the file does not say.
    pub number_of_returns: u8,
    /// ASPRS class (2 ground, 7 low noise, 18 high noise).
    pub classification: u8,
    /// Flags: bit 0 synthetic, 1 key point, 2 withheld, 3 overlap, 4 edge of flight line, 5 scan direction.
    pub flags: u8,
    /// Scan angle in degrees, positive to the right of the track.
    pub scan_angle_deg: f32,
    /// GPS time in seconds (of the week, or adjusted standard, as in the file); NaN where missing.
    pub gps_time: f64,
    /// Flight line or scan position.
    pub source_id: u16,
}

/// Points as columns in a local frame. All columns have the same length.
///
/// Positions are in metres in `frame`; [`Frame`] says why differences of them are exact.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PointCloud {
    /// The frame of the positions.
    pub frame: Frame,
    /// Local x (easting), metres.
    pub x: Vec<f64>,
    /// Local y (northing), metres.
    pub y: Vec<f64>,
    /// Local z (elevation), metres.
    pub z: Vec<f64>,
    /// See [`Point::intensity`].
    pub intensity: Vec<u16>,
    /// See [`Point::return_number`].
    pub return_number: Vec<u8>,
    /// See [`Point::number_of_returns`].
    pub number_of_returns: Vec<u8>,
    /// See [`Point::classification`].
    pub classification: Vec<u8>,
    /// See [`Point::flags`].
    pub flags: Vec<u8>,
    /// See [`Point::scan_angle_deg`].
    pub scan_angle_deg: Vec<f32>,
    /// See [`Point::gps_time`].
    pub gps_time: Vec<f64>,
    /// See [`Point::source_id`].
    pub source_id: Vec<u16>,
    /// Further attributes by name.
    pub extra: BTreeMap<String, Column>,
}

impl PointCloud {
    /// No points, in the given frame.
    #[must_use]
    pub fn new(frame: Frame) -> Self {
        Self { frame, ..Self::default() }
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Position in the local frame.
    #[must_use]
    pub fn local(&self, index: usize) -> [f64; 3] {
        [self.x[index], self.y[index], self.z[index]]
    }

    /// Position in the world.
    #[must_use]
    pub fn world(&self, index: usize) -> [f64; 3] {
        self.frame.world_from_local(self.local(index))
    }

    /// The attributes of one point.
    #[must_use]
    pub fn point(&self, index: usize) -> Point {
        Point {
            intensity: self.intensity[index],
            return_number: self.return_number[index],
            number_of_returns: self.number_of_returns[index],
            classification: self.classification[index],
            flags: self.flags[index],
            scan_angle_deg: self.scan_angle_deg[index],
            gps_time: self.gps_time[index],
            source_id: self.source_id[index],
        }
    }

    /// Adds a point at a world position. Extra columns get a zero.
    pub fn push_world(&mut self, world_m: [f64; 3], point: &Point) {
        self.push_local(self.frame.local_from_world(world_m), point);
    }

    /// Adds a point at a local position. Extra columns get a zero.
    pub fn push_local(&mut self, local_m: [f64; 3], point: &Point) {
        self.x.push(local_m[0]);
        self.y.push(local_m[1]);
        self.z.push(local_m[2]);
        self.intensity.push(point.intensity);
        self.return_number.push(point.return_number);
        self.number_of_returns.push(point.number_of_returns);
        self.classification.push(point.classification);
        self.flags.push(point.flags);
        self.scan_angle_deg.push(point.scan_angle_deg);
        self.gps_time.push(point.gps_time);
        self.source_id.push(point.source_id);
        let len = self.len();
        self.extra.values_mut().for_each(|column| column.pad(len));
    }

    /// Bounds in the local frame.
    #[must_use]
    pub fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        (0..self.len()).for_each(|index| bounds.include(self.local(index)));
        bounds
    }

    /// Appends all points of another cloud, moving them into this frame (exact). A column missing
    /// on one side is filled with zeros there.
    ///
    /// # Errors
    /// [`Error::ColumnType`] when an extra column has different types; nothing is appended then.
    pub fn append(&mut self, other: &Self) -> Result<(), Error> {
        self.check_extra_types(other)?;
        let (before, after) = (self.len(), self.len() + other.len());
        let [dx, dy, dz] = self.frame.shift_from(&other.frame);
        self.x.extend(other.x.iter().map(|value| value + dx));
        self.y.extend(other.y.iter().map(|value| value + dy));
        self.z.extend(other.z.iter().map(|value| value + dz));
        self.intensity.extend_from_slice(&other.intensity);
        self.return_number.extend_from_slice(&other.return_number);
        self.number_of_returns.extend_from_slice(&other.number_of_returns);
        self.classification.extend_from_slice(&other.classification);
        self.flags.extend_from_slice(&other.flags);
        self.scan_angle_deg.extend_from_slice(&other.scan_angle_deg);
        self.gps_time.extend_from_slice(&other.gps_time);
        self.source_id.extend_from_slice(&other.source_id);
        for (name, column) in &other.extra {
            let mine = self.extra.entry(name.clone()).or_insert_with(|| column.like());
            mine.pad(before);
            mine.append(column)?;
        }
        self.extra.values_mut().for_each(|column| column.pad(after));
        Ok(())
    }

    fn check_extra_types(&self, other: &Self) -> Result<(), Error> {
        for (name, column) in &other.extra {
            if let Some(mine) = self.extra.get(name)
                && mine.type_name() != column.type_name()
            {
                let (left, right) = (mine.type_name(), column.type_name());
                return Err(Error::ColumnType { column: name.clone(), left, right });
            }
        }
        Ok(())
    }

    /// The points at the given indices, in their order.
    #[must_use]
    pub fn select(&self, indices: &[u32]) -> Self {
        fn pick<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().map(|&index| values[index as usize]).collect()
        }
        Self {
            frame: self.frame,
            x: pick(&self.x, indices),
            y: pick(&self.y, indices),
            z: pick(&self.z, indices),
            intensity: pick(&self.intensity, indices),
            return_number: pick(&self.return_number, indices),
            number_of_returns: pick(&self.number_of_returns, indices),
            classification: pick(&self.classification, indices),
            flags: pick(&self.flags, indices),
            scan_angle_deg: pick(&self.scan_angle_deg, indices),
            gps_time: pick(&self.gps_time, indices),
            source_id: pick(&self.source_id, indices),
            extra: self.extra.iter().map(|(k, v)| (k.clone(), v.select(indices))).collect(),
        }
    }

    /// The same points in the canonical order of [`order::canonical_order`].
    #[must_use]
    pub fn in_canonical_order(&self) -> Self {
        self.select(&order::canonical_order(self))
    }

    /// The same points in another frame (exact).
    #[must_use]
    pub fn in_frame(mut self, frame: Frame) -> Self {
        let [dx, dy, dz] = frame.shift_from(&self.frame);
        self.x.iter_mut().for_each(|value| *value += dx);
        self.y.iter_mut().for_each(|value| *value += dy);
        self.z.iter_mut().for_each(|value| *value += dz);
        self.frame = frame;
        self
    }

    /// Checks that all columns have one length.
    ///
    /// # Errors
    /// [`Error::ColumnLength`] naming the first that differs.
    pub fn validate(&self) -> Result<(), Error> {
        let expected = self.len();
        let fixed = [
            ("y", self.y.len()),
            ("z", self.z.len()),
            ("intensity", self.intensity.len()),
            ("return_number", self.return_number.len()),
            ("number_of_returns", self.number_of_returns.len()),
            ("classification", self.classification.len()),
            ("flags", self.flags.len()),
            ("scan_angle_deg", self.scan_angle_deg.len()),
            ("gps_time", self.gps_time.len()),
            ("source_id", self.source_id.len()),
        ];
        let extra = self.extra.iter().map(|(name, column)| (name.as_str(), column.len()));
        match fixed.into_iter().chain(extra).find(|(_, found)| *found != expected) {
            None => Ok(()),
            Some((column, found)) => {
                Err(Error::ColumnLength { column: column.to_owned(), expected, found })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_at(frame: [i64; 3], world: [f64; 3]) -> PointCloud {
        let mut cloud = PointCloud::new(Frame::new(frame));
        cloud.push_world(world, &Point { intensity: 7, ..Point::default() });
        cloud
    }

    #[test]
    fn append_moves_frames_and_fills_columns() {
        let mut left = one_at([100, 0, 0], [101.25, 3.5, 9.0]);
        let mut right = one_at([90, -7, 2], [95.5, -6.75, 2.25]);
        right.extra.insert("label".into(), Column::U8(vec![4]));
        left.append(&right).unwrap();
        assert_eq!(left.world(1), [95.5, -6.75, 2.25]);
        assert_eq!(left.extra["label"], Column::U8(vec![0, 4]));
        left.validate().unwrap();
    }

    #[test]
    fn append_refuses_another_type() {
        let mut left = one_at([0; 3], [1.0; 3]);
        let mut right = left.clone();
        left.extra.insert("label".into(), Column::U8(vec![4]));
        right.extra.insert("label".into(), Column::F64(vec![4.0]));
        assert!(left.append(&right).unwrap_err().to_string().contains("`label` is u8"));
        assert_eq!(left.len(), 1);
    }

    #[test]
    fn a_short_column_is_named() {
        let mut cloud = one_at([0; 3], [1.0; 3]);
        cloud.gps_time.clear();
        assert!(cloud.validate().unwrap_err().to_string().contains("`gps_time` has 0"));
    }
}
