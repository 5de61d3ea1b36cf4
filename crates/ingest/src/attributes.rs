//! Columns of formats without fixed fields, and what they are in a point.

use std::collections::BTreeSet;

/// What a column of a file becomes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Role {
    /// Coordinate: 0 x, 1 y, 2 z.
    Axis(usize),
    /// Strength of the echo.
    Intensity,
    /// Return of its pulse, from 1.
    ReturnNumber,
    /// Returns of the pulse.
    NumberOfReturns,
    /// ASPRS class.
    Classification,
    /// Scan angle, degrees.
    ScanAngle,
    /// GPS time, seconds.
    GpsTime,
    /// Flight line or scan.
    SourceId,
    /// Colour: 0 red, 1 green, 2 blue. Becomes an extra column of 16 bits.
    Colour(usize),
    /// An extra column of that name.
    Extra(String),
}

/// Names of the colours' extra columns.
pub(crate) const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// Spellings in use, in small letters with `_` for anything that is no letter or digit: those of
/// PDAL's dimensions, CloudCompare's and RiSCAN's text exports, PCL's fields and `laspy`.
const SPELLINGS: [(&[&str], Role); 13] = [
    (&["x", "coordinate_x", "x_coordinate", "easting", "east"], Role::Axis(0)),
    (&["y", "coordinate_y", "y_coordinate", "northing", "north"], Role::Axis(1)),
    (&["z", "coordinate_z", "z_coordinate", "elevation", "altitude"], Role::Axis(2)),
    (&["intensity", "i", "int"], Role::Intensity),
    (
        &["return_number", "returnnumber", "return_no", "return", "return_index", "rn"],
        Role::ReturnNumber,
    ),
    (
        &["number_of_returns", "numberofreturns", "num_returns", "return_count", "nr"],
        Role::NumberOfReturns,
    ),
    (&["classification", "class"], Role::Classification),
    (
        &["scan_angle", "scan_angle_rank", "scanangle", "scananglerank", "scan_angle_deg"],
        Role::ScanAngle,
    ),
    (&["gps_time", "gpstime", "time", "timestamp", "time_stamp"], Role::GpsTime),
    (&["point_source_id", "pointsourceid", "source_id", "scan_id", "scan"], Role::SourceId),
    (&["red", "r", "diffuse_red"], Role::Colour(0)),
    (&["green", "g", "diffuse_green"], Role::Colour(1)),
    (&["blue", "b", "diffuse_blue"], Role::Colour(2)),
];

impl Role {
    /// What a column of that name is; names nobody knows are extra columns.
    pub(crate) fn of(name: &str) -> Self {
        let plain = plain(name);
        let known = SPELLINGS.iter().find(|(names, _)| names.contains(&plain.as_str()));
        known.map_or_else(|| Self::Extra(name.trim().to_owned()), |(_, role)| role.clone())
    }
}

/// A name in small letters, without quotes, a unit in brackets, and CloudCompare's `scalar_`.
fn plain(name: &str) -> String {
    let name = name.trim().trim_matches(['"', '\'']);
    let name = name.split(['[', '(', '{']).next().unwrap_or_default().trim();
    let letters =
        name.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '_' });
    let name: String = letters.collect();
    let name = name.trim_matches('_');
    name.strip_prefix("scalar_").unwrap_or(name).to_owned()
}

/// More attributes than any file has.
const MAX_ROLES: usize = 256;
/// Extra columns of other origin.
const TAKEN: [&str; 6] = ["red", "green", "blue", "nir", "user_data", "scanner_channel"];

/// The roles of named columns, each taken once: `None` for columns beyond the first 256, a second
/// x and so on become extra columns.
pub(crate) fn roles_of<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<Option<Role>> {
    let mut taken: Vec<Role> = Vec::new();
    let mut extra: BTreeSet<String> = TAKEN.iter().map(|name| (*name).to_owned()).collect();
    let mut roles = Vec::new();
    for (index, name) in names.into_iter().enumerate() {
        let role = match Role::of(name) {
            Role::Extra(name) => Role::Extra(free(&name, index, &mut extra)),
            role if taken.contains(&role) => Role::Extra(free(name, index, &mut extra)),
            role => role,
        };
        taken.push(role.clone());
        roles.push((index < MAX_ROLES).then_some(role));
    }
    roles
}

/// A name for an extra column that is not in use: the given one, or with the first free number.
fn free(name: &str, index: usize, taken: &mut BTreeSet<String>) -> String {
    let name = name.trim().trim_matches(['"', '\'']);
    let base = if name.is_empty() { format!("column_{}", index + 1) } else { name.to_owned() };
    let numbered = (2..).map(|number| format!("{base}_{number}"));
    let mut names = std::iter::once(base.clone()).chain(numbered);
    let found = names.find(|name| !taken.contains(name)).unwrap_or(base);
    taken.insert(found.clone());
    found
}

/// Which axes no column is.
pub(crate) fn missing_axes(roles: &[Option<Role>]) -> Vec<&'static str> {
    let has = |axis: usize| roles.contains(&Some(Role::Axis(axis)));
    ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .filter(|(i, _)| !has(*i))
        .map(|(_, name)| name)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_in_use_are_known() {
        let check = |name: &str, role: Role| assert_eq!(Role::of(name), role, "{name}");
        check("X", Role::Axis(0));
        check(" \"Easting\" ", Role::Axis(0));
        check("z[m]", Role::Axis(2));
        check("scalar_Intensity", Role::Intensity);
        check("Scan Angle Rank", Role::ScanAngle);
        check("GpsTime", Role::GpsTime);
        check("diffuse_green", Role::Colour(1));
        check("Reflectance", Role::Extra("Reflectance".into()));
    }

    #[test]
    fn a_second_column_of_a_name_is_kept_beside_the_first() {
        let roles = roles_of(["x", "y", "z", "depth", "depth", "X", "nir", ""]);
        let names: Vec<String> = roles[3..]
            .iter()
            .map(|role| match role {
                Some(Role::Extra(name)) => name.clone(),
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(names, ["depth", "depth_2", "X", "nir_2", "column_8"]);
        assert!(missing_axes(&roles).is_empty());
        assert_eq!(missing_axes(&roles_of(["x", "q"])), ["y", "z"]);
    }
}
