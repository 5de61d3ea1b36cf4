//! What a program returns: read, and checked against what it was given.

use super::layout::{Dimension, Number, RECORD, USER, dimensions, value};
use super::{Answer, Failure, Request, give};
use las::Reader;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

const CSV: &str = "out.csv";
const LAZ: &str = "out.laz";
/// Names of the dimension or column that holds the tree.
const TREE: [&str; 2] = ["tree_id", "treeID"];
const SCORE: &str = "score";
/// Points decoded at once.
const SLAB: u64 = 200_000;

/// Reads the answer in a folder.
pub(super) fn take(folder: &Path, request: &Request<'_>) -> Result<Answer, Failure> {
    let [csv, laz] = [CSV, LAZ].map(|name| folder.join(name));
    match (csv.is_file(), laz.is_file()) {
        (true, true) => Err(Failure::TwoOutputs),
        (true, false) => table(&csv, request),
        (false, true) => cloud(&laz, request),
        (false, false) => Err(Failure::NoOutput),
    }
}

/// An answer that is filled point by point.
struct Filling {
    file: &'static str,
    known: BTreeSet<u64>,
    answer: Answer,
}

impl Filling {
    fn new(file: &'static str, request: &Request<'_>, with_score: bool) -> Self {
        let points = request.cloud.len();
        let score = with_score.then(|| vec![0.0; points]);
        let known = request.markers.iter().map(|marker| marker.crown.id).collect();
        Self { file, known, answer: Answer { tree_id: vec![0; points], score } }
    }

    /// Puts the values of a point, checked, in their place.
    fn put(
        &mut self,
        point: usize,
        tree: Number,
        score: Option<Number>,
        place: &dyn Fn() -> String,
    ) -> Result<(), Failure> {
        let known = tree.whole().filter(|id| *id == 0 || self.known.contains(id));
        let id = known.ok_or_else(|| Failure::foreign(self.file, place(), tree))?;
        self.answer.tree_id[point] = id;
        if let (Some(scores), Some(score)) = (&mut self.answer.score, score) {
            if !(0.0..=1.0).contains(&score.real()) {
                let detail = format!("score {score} must be a number from 0 to 1");
                return Err(Failure::Record { file: self.file, place: place(), detail });
            }
            scores[point] = score.real() as f32;
        }
        Ok(())
    }
}

fn unreadable(file: &'static str, detail: impl Into<String>) -> Failure {
    Failure::Unreadable { file, detail: detail.into() }
}

/// Reads `point,tree_id[,score]`.
fn table(path: &Path, request: &Request<'_>) -> Result<Answer, Failure> {
    let file = std::fs::File::open(path).map_err(Failure::io(path, "read"))?;
    let mut lines = BufReader::new(file).lines();
    let wanted = "the first line must be point,tree_id or point,tree_id,score";
    let mut line = || match lines.next() {
        None => Ok(None),
        Some(Ok(line)) => Ok(Some(line)),
        Some(Err(error)) => Err(unreadable(CSV, format!("{error}; it must be text in UTF-8"))),
    };
    let header = line()?.ok_or_else(|| unreadable(CSV, format!("is empty; {wanted}")))?;
    let with_score = header_has_score(&header)
        .ok_or_else(|| unreadable(CSV, format!("begins with `{}`; {wanted}", cut(&header))))?;
    let mut filling = Filling::new(CSV, request, with_score);
    let mut seen = vec![false; request.cloud.len()];
    let (mut number, mut rows) = (1_u64, 0_u64);
    while let Some(line) = line()? {
        number += 1;
        if line.trim().is_empty() {
            continue;
        }
        rows += 1;
        row(&line, number, with_score, &mut seen, &mut filling)?;
    }
    let expected = seen.len() as u64;
    if rows == expected {
        return Ok(filling.answer);
    }
    Err(Failure::Count { file: CSV, what: "rows", expected, found: rows })
}

/// Whether the rows have scores; `None` for another header.
fn header_has_score(line: &str) -> Option<bool> {
    let names: Vec<&str> = line
        .trim_start_matches('\u{FEFF}')
        .split(',')
        .map(|name| name.trim().trim_matches('"'))
        .collect();
    match names[..] {
        ["point", tree] if TREE.contains(&tree) => Some(false),
        ["point", tree, SCORE] if TREE.contains(&tree) => Some(true),
        _ => None,
    }
}

fn row(
    line: &str,
    number: u64,
    with_score: bool,
    seen: &mut [bool],
    filling: &mut Filling,
) -> Result<(), Failure> {
    let place = || format!("line {number}");
    let wrong = |detail: String| Failure::Record { file: CSV, place: place(), detail };
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    let expected = if with_score { 3 } else { 2 };
    if fields.len() != expected {
        return Err(wrong(format!("`{}` has {} fields, not {expected}", cut(line), fields.len())));
    }
    let last = seen.len().saturating_sub(1);
    let index = parse(fields[0]).and_then(Number::whole).map(|index| index as usize);
    let index = index.filter(|index| *index <= last && !seen.is_empty()).ok_or_else(|| {
        wrong(format!("point `{}` must be a whole number from 0 to {last}", cut(fields[0])))
    })?;
    if std::mem::replace(&mut seen[index], true) {
        return Err(wrong(format!("point {index} comes a second time; give each once")));
    }
    let value =
        |text: &str| parse(text).ok_or_else(|| wrong(format!("`{}` is no number", cut(text))));
    let tree = value(fields[1])?;
    let score = fields.get(2).map(|text| value(text)).transpose()?;
    filling.put(index, tree, score, &place)
}

fn parse(text: &str) -> Option<Number> {
    let whole = text.parse().ok().map(Number::Whole);
    whole.or_else(|| text.parse().ok().map(Number::Real))
}

/// The beginning of a text, for messages.
fn cut(text: &str) -> String {
    const MOST: usize = 60;
    let mut short: String = text.chars().take(MOST).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}

/// Reads a LAS or LAZ file with the dimension `tree_id`.
fn cloud(path: &Path, request: &Request<'_>) -> Result<Answer, Failure> {
    // The reader of the `las` crate panics on some broken files.
    let read = catch_unwind(AssertUnwindSafe(|| records(path, request)));
    read.unwrap_or_else(|_| Err(unreadable(LAZ, "is broken; write it with a LAS library")))
}

fn records(path: &Path, request: &Request<'_>) -> Result<Answer, Failure> {
    let words = |error: las::Error| unreadable(LAZ, format!("cannot be read as LAZ: {error}"));
    let mut reader = Reader::from_path(path).map_err(words)?;
    let (expected, found) = (request.cloud.len() as u64, reader.header().number_of_points());
    if expected != found {
        return Err(Failure::Count { file: LAZ, what: "points", expected, found });
    }
    let (tree, score) = find_dimensions(&reader)?;
    let mut filling = Filling::new(LAZ, request, score.is_some());
    let extra_len = usize::from(reader.header().point_format().extra_bytes);
    let mut next = 0;
    while next < request.cloud.len() {
        let slab = reader.read_points(SLAB.min(expected - next as u64)).map_err(words)?;
        if slab.is_empty() {
            return Err(unreadable(LAZ, format!("ends after {next} of {found} points")));
        }
        let positions = slab.x().zip(slab.y()).zip(slab.z());
        let records = slab.raw_bytes().chunks_exact(slab.record_len()).zip(positions);
        for (record, ((x, y), z)) in records {
            let place = || format!("record {next} (from 0)");
            check_position(request, next, [x, y, z], &place)?;
            let extra = &record[record.len().saturating_sub(extra_len)..];
            let number = |dimension: &Dimension| {
                let name = &dimension.name;
                value(dimension, extra)
                    .ok_or_else(|| unreadable(LAZ, format!("`{name}` lies beyond the record")))
            };
            let score = score.as_ref().map(number).transpose()?;
            filling.put(next, number(&tree)?, score, &place)?;
            next += 1;
        }
    }
    Ok(filling.answer)
}

/// The dimensions of the tree and, if there is one, of the score.
fn find_dimensions(reader: &Reader) -> Result<(Dimension, Option<Dimension>), Failure> {
    let described =
        reader.header().all_vlrs().find(|vlr| vlr.user_id == USER && vlr.record_id == RECORD);
    let all = described.map(|vlr| dimensions(&vlr.data)).unwrap_or_default();
    let names: Vec<&str> = all.iter().map(|dimension| dimension.name.as_str()).collect();
    let tree = all.iter().find(|dimension| TREE.contains(&dimension.name.as_str()));
    let tree = tree.ok_or_else(|| {
        let has = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        unreadable(LAZ, format!("has no extra dimension `tree_id` (it has: {has}); add it"))
    })?;
    let score = all.iter().find(|dimension| dimension.name == SCORE);
    if let Some(scaled) = [Some(tree), score].into_iter().flatten().find(|d| d.is_scaled) {
        let detail = format!("`{}` has a scale or an offset; write plain numbers", scaled.name);
        return Err(unreadable(LAZ, detail));
    }
    Ok((tree.clone(), score.cloned()))
}

/// Largest difference to the position given, in units of the system: files may be written with
/// another scale.
const SAME_PLACE: f64 = 0.01;

fn check_position(
    request: &Request<'_>,
    index: usize,
    found: [f64; 3],
    place: &dyn Fn() -> String,
) -> Result<(), Failure> {
    let given = give::position(request, index);
    if given.iter().zip(found).all(|(given, found)| (given - found).abs() <= SAME_PLACE) {
        return Ok(());
    }
    let words = |at: [f64; 3]| at.map(|value| format!("{value:.3}")).join(" ");
    let detail = format!(
        "is at {}, that of in.laz at {}; return the points in their sequence",
        words(found),
        words(given)
    );
    Err(Failure::Record { file: LAZ, place: place(), detail })
}
