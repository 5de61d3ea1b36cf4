//! Cylinders with the fields of TreeQSM (Raumonen et al. 2013; the struct `cylinder` of its manual, version
//! 2.4, in the order in which it saves text files): numbers begin at 1, 0 is none.

use super::Model;
use crate::Error;
use std::path::Path;
use timberline_artefact::kinds::RadiusSource;
use timberline_solids::vector::{distance, scale, sub};

/// The names, as TreeQSM has them; vectors with an ending for their part.
const NAMES: [&str; 16] = [
    "radius",
    "length",
    "start_x",
    "start_y",
    "start_z",
    "axis_x",
    "axis_y",
    "axis_z",
    "parent",
    "extension",
    "branch",
    "BranchOrder",
    "PositionInBranch",
    "added",
    "UnmodRadius",
    "SurfCov",
];

/// The table; lengths and positions in metres in the world. `added` marks inferred cylinders, and
/// `UnmodRadius` is the radius: no radius is changed after the fit.
///
/// # Errors
/// [`Error::Csv`].
pub fn write(model: &Model<'_>, path: &Path) -> Result<Vec<u8>, Error> {
    let fail = |source| Error::Csv { path: path.to_path_buf(), source };
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(NAMES).map_err(fail)?;
    for place in 0..model.qsm.cylinders.len() {
        writer.write_record(row(model, place)).map_err(fail)?;
    }
    writer.into_inner().map_err(|error| Error::io(path, "write")(error.into_error()))
}

fn row(model: &Model<'_>, place: usize) -> [String; 16] {
    let qsm = model.qsm;
    let c = &qsm.cylinders[place];
    let length_m = distance(c.start_m, c.end_m);
    let axis =
        if length_m > 0.0 { scale(sub(c.end_m, c.start_m), 1.0 / length_m) } else { [0.0; 3] };
    let start = model.frame.world_from_local(c.start_m);
    let (order, position) = qsm
        .branches
        .get(c.branch as usize)
        .map_or((0, 0), |b| (b.order, place as i64 - i64::from(b.first) + 1));
    let next = qsm.cylinders.get(place + 1).filter(|n| n.branch == c.branch);
    let extension = if next.is_some() { place + 2 } else { 0 };
    let real = |value: f64| format!("{:.6}", value + 0.0);
    [
        real(c.radius_m),
        real(length_m),
        real(start[0]),
        real(start[1]),
        real(start[2]),
        real(axis[0]),
        real(axis[1]),
        real(axis[2]),
        c.parent.map_or(0, |parent| parent + 1).to_string(),
        extension.to_string(),
        (c.branch + 1).to_string(),
        order.to_string(),
        position.to_string(),
        u8::from(c.source == RadiusSource::Inferred).to_string(),
        real(c.radius_m),
        format!("{:.3}", c.arc_coverage),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{FRAME, fork};
    use timberline_artefact::Crs;

    #[test]
    fn links_are_those_of_treeqsm() {
        let (qsm, crs) = (fork(7), Crs::default());
        let bytes =
            write(&Model { qsm: &qsm, frame: FRAME, crs: &crs }, Path::new("t.csv")).unwrap();
        let mut reader = csv::Reader::from_reader(bytes.as_slice());
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        let column = |name: &str| {
            let at = NAMES.iter().position(|other| *other == name).unwrap();
            rows.iter().map(|row| row[at].to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(column("parent"), ["0", "1", "2", "2"]);
        assert_eq!(column("extension"), ["2", "3", "0", "0"]);
        assert_eq!(column("PositionInBranch"), ["1", "2", "3", "1"]);
        assert_eq!(column("BranchOrder"), ["0", "0", "0", "1"]);
        assert_eq!(column("added"), ["0", "0", "0", "1"]);
        assert_eq!(column("start_x")[0], "500000.500000");
        assert_eq!(column("axis_z")[0], "1.000000");
    }
}
