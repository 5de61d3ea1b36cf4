//! Every file of the collection of formats, oddities and broken files is read or refused: no
//! panic, no hang, an error that names file, place and remedy.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use timberline_ingest::scatter::scatter;
use timberline_ingest::{Damaged, ScatterParams, UnitChoice, scan};
use timberline_pointcloud::TileGrid;

const LIMIT: Duration = Duration::from_secs(10);

/// What came of a file.
struct Outcome {
    text: String,
    /// Points, bounds and sums for a comparison with another reader.
    facts: String,
    is_refused: bool,
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files(&path, found) } else { found.push(path) }
    }
}

fn read(path: &Path, damaged: Damaged) -> Outcome {
    let params = ScatterParams { damaged, ..ScatterParams::default() };
    let refused = |error: timberline_ingest::Error| {
        let text = error.in_file(path).to_string();
        assert!(text.contains(&*path.to_string_lossy()), "no file in: {text}");
        assert!(text.contains("; "), "no remedy in: {text}");
        Outcome { text: format!("refused: {text}"), facts: String::new(), is_refused: true }
    };
    let grid = TileGrid::new(128, [0, 0]).unwrap();
    let file = match scan::open(path, UnitChoice::default(), None) {
        Ok(file) => file,
        Err(error) => return refused(error),
    };
    let (container, crs) = (file.container(), file.crs().clone());
    let columns: Vec<String> = file.extra().iter().map(|field| field.name.clone()).collect();
    let facts = sums(path);
    match scatter(file, grid, &params, std::io::sink(), |_| Ok(())) {
        Err(error) => refused(error),
        Ok((_, scattered)) => {
            let mut text = format!(
                "{} points, {container}, {} tiles, {}",
                scattered.index.points,
                scattered.index.tiles().len(),
                crs.name
            );
            if crs.horizontal_m_per_unit != 1.0 {
                write!(text, ", unit {:.7} m", crs.horizontal_m_per_unit).unwrap();
            }
            if !columns.is_empty() {
                write!(text, ", extra {}", columns.join(" ")).unwrap();
            }
            for note in &scattered.notes {
                write!(text, "; note: {note}").unwrap();
            }
            Outcome { text, facts, is_refused: false }
        }
    }
}

/// Number, bounds and sums of what is read, in the units of the file.
fn sums(path: &Path) -> String {
    let mut file = scan::open(path, UnitChoice::default(), None).unwrap();
    let crs = file.crs().clone();
    let (mut count, mut sum) = (0u64, [0.0; 3]);
    let mut bytes = [0u64; 6];
    let mut gps = 0.0;
    while let Some(cloud) = file.next_batch().unwrap() {
        count += cloud.len() as u64;
        for index in 0..cloud.len() {
            let at = crs.crs_from_world(cloud.world(index));
            (0..3).for_each(|axis| sum[axis] += at[axis]);
            let point = cloud.point(index);
            bytes[0] += u64::from(point.intensity);
            bytes[1] += u64::from(point.return_number);
            bytes[2] += u64::from(point.number_of_returns);
            bytes[3] += u64::from(point.classification);
            bytes[4] += u64::from(point.source_id);
            bytes[5] += cloud.extra.get("user_data").map_or(0, |user| user.value(index) as u64);
            gps += if point.gps_time.is_finite() { point.gps_time } else { 0.0 };
        }
    }
    format!(
        "{count},{},{},{},{gps},{}",
        sum[0],
        sum[1],
        sum[2],
        bytes.map(|b| b.to_string()).join(",")
    )
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn every_file_is_read_or_refused() {
    let data = PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap());
    let mut paths = Vec::new();
    files(&data.join("formats"), &mut paths);
    files(&data.join("als/edge"), &mut paths);
    paths.sort();
    let (mut table, mut sums) = (String::new(), String::new());
    let (mut read_count, mut refused) = (0, 0);
    for path in &paths {
        let name = path.strip_prefix(&data).unwrap().display().to_string();
        let (send, receive) = mpsc::channel();
        let start = Instant::now();
        let thread = {
            let path = path.clone();
            std::thread::spawn(move || send.send(read(&path, Damaged::Refuse)))
        };
        let outcome = receive.recv_timeout(LIMIT).unwrap_or_else(|error| panic!("{name}: {error}"));
        thread.join().unwrap().unwrap();
        let seconds = start.elapsed().as_secs_f64();
        if outcome.is_refused {
            refused += 1;
        } else {
            read_count += 1;
        }
        let text = outcome.text.replace(&*path.to_string_lossy(), "FILE");
        writeln!(table, "| {name} | {} | {seconds:.2} s |", text.replace('|', "/")).unwrap();
        if !outcome.is_refused {
            writeln!(sums, "{name},{}", outcome.facts).unwrap();
        }
    }
    let table = format!(
        "{} files: {read_count} read, {refused} refused\n\n| file | outcome | time |\n|---|---|---|\n{table}",
        paths.len()
    );
    println!("{table}");
    if let Ok(folder) = std::env::var("TIMBERLINE_TABLES") {
        std::fs::write(Path::new(&folder).join("formats_table.md"), &table).unwrap();
        std::fs::write(Path::new(&folder).join("formats_sums.csv"), &sums).unwrap();
    }
}
