//! Programs of a few words of shell: good ones, bad ones, and what is said about them.

use super::*;
use crate::Crown;
use std::time::{Duration, Instant};
use timberline_pointcloud::{Frame, Point};

/// A tree of three points, a tree of one, and a point on the ground; and what a segmenter is told.
struct Question {
    cloud: PointCloud,
    height_m: Vec<f32>,
    markers: Vec<Marker>,
    crs: Crs,
}

const POINTS: usize = 5;
const FLAGS: [bool; POINTS] = [false, true, true, true, true];

impl Question {
    fn new() -> Self {
        let mut cloud = PointCloud::new(Frame::new([500_000, 4_000_000, 100]));
        let positions =
            [[3.0, 1.0, 0.0], [1.0, 1.0, 12.0], [1.5, 1.0, 11.0], [1.0, 1.0, 3.0], [9.0, 9.0, 7.5]];
        let attributes =
            Point { return_number: 1, number_of_returns: 2, classification: 2, ..Point::default() };
        positions.into_iter().for_each(|at| cloud.push_local(at, &attributes));
        let marker = |id: u64, apex: [f64; 3]| Marker {
            crown: Crown {
                id,
                apex,
                coefficients: [0.0; 2],
                radius_m: 2.0,
                tolerance_m: 0.3,
                oblique: false,
            },
            height_m: apex[2],
            score: 0.75,
        };
        Self {
            height_m: positions.iter().map(|at| at[2] as f32).collect(),
            cloud,
            markers: vec![marker(71, positions[1]), marker(72, positions[4])],
            crs: Crs { epsg: Some(32610), ..Crs::default() },
        }
    }

    fn request(&self) -> Request<'_> {
        Request {
            cloud: &self.cloud,
            height_m: &self.height_m,
            is_ground: &[true, false, false, false, false],
            own: &FLAGS,
            markers: &self.markers,
            reach_m: 10.0,
            crs: &self.crs,
        }
    }
}

const LIMITS: Limits = Limits { time: Duration::from_secs(60), memory_bytes: 1_000_000_000 };

struct Ran {
    answer: Result<Vec<Claim>, Failure>,
    log: String,
}

impl Ran {
    fn error(self) -> String {
        self.answer.unwrap_err().to_string()
    }

    fn ids(self) -> Vec<u64> {
        self.answer.unwrap().iter().map(|claim| claim.id).collect()
    }
}

/// Runs words of shell, in which `$6` is what `--out` says.
fn shell(script: &str, limits: Limits) -> Ran {
    run_words(&["/bin/sh", "-c", script, "script"], limits, &|| false)
}

fn run_words(command: &[&str], limits: Limits, cancelled: &dyn Fn() -> bool) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    let question = Question::new();
    let command: Vec<String> = command.iter().map(|word| (*word).to_owned()).collect();
    let program = Program {
        command: &command,
        title: "the program",
        environment: &[("TIMBERLINE_UNIT", "tile:1_2".to_owned())],
        limits,
        folder: folder.path(),
    };
    let mut log = String::new();
    let answer = segment(&question.request(), &program, cancelled, &mut |text| log += &text);
    Ran { answer, log }
}

/// What is said when the program writes `text` to out.csv.
fn csv(text: &str) -> Ran {
    shell(&format!("printf '%b' '{}' > \"$6.csv\"", text.replace('\n', "\\n")), LIMITS)
}

const GOOD: &str = "point,tree_id\n0,0\n1,71\n2,71\n3,71\n4,72\n";

#[test]
fn a_good_answer_gets_scores_by_the_surface() {
    let claims = csv(GOOD).answer.unwrap();
    let ids: Vec<u64> = claims.iter().map(|claim| claim.id).collect();
    assert_eq!(ids, [0, 71, 71, 71, 72]);
    let on_surface: Vec<bool> = claims.iter().map(|claim| claim.score > 0.5).collect();
    assert_eq!(on_surface, [false, true, true, false, true], "{claims:?}");
}

#[test]
fn points_far_from_their_tree_get_none() {
    let ran = csv(&GOOD.replace("4,72", "4,71").replace("0,0", "0,72"));
    let expected = "1 points farther than reach_m = 10 m from the top of their tree got none";
    assert!(ran.log.ends_with(expected), "{}", ran.log);
    assert_eq!(ran.ids(), [72, 71, 71, 71, 0]);
}

#[test]
fn rows_may_come_in_any_sequence_with_scores() {
    let claims = csv("point,treeID,score\n4,72.0,1\n3,71,0.5\n\n2,71,0.25\n1,71,1e-1\n0,0,0.9");
    let claims = claims.answer.unwrap();
    let scores: Vec<f32> = claims.iter().map(|claim| claim.score).collect();
    assert_eq!(scores, [0.0, 0.1, 0.25, 0.5, 1.0]);
}

#[test]
fn the_program_is_given_what_it_needs() {
    let script = format!(
        "echo $TIMBERLINE_UNIT; echo \"$1 $3 $5\"; ls; cat \"$4\"; test \"$2\" = \"$PWD/in.laz\" || exit 9; \
         printf '{}' > out.csv",
        GOOD.replace('\n', "\\n")
    );
    let ran = shell(&script, LIMITS);
    for part in [
        "`the program` ended with exit status: 0 after",
        "MB of memory\nstdout:\ntile:1_2\n--points --tops --out\nin.laz\ntops.csv\n\
         id,x,y,z,height_m,radius_m,score\n71,500001.0000,4000001.0000,112.0000,12.000,2.000,0.750\n72,",
    ] {
        assert!(ran.log.contains(part), "{part} in\n{}", ran.log);
    }
    assert_eq!(ran.ids(), [0, 71, 71, 71, 72]);
}

#[test]
fn the_points_are_laz_with_crs_classes_height_and_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.laz");
    give::points(&Question::new().request(), &path).unwrap();
    let mut reader = las::Reader::from_path(&path).unwrap();
    let header = reader.header();
    assert_eq!((header.version().minor, header.point_format().to_u8().unwrap()), (4, 6));
    let wkt = header.all_vlrs().find(|vlr| vlr.record_id == 2112).unwrap();
    assert!(wkt.data.starts_with(b"PROJCS[\"WGS 84 / UTM zone 10N\""));
    let described = header.all_vlrs().find(|vlr| vlr.record_id == 4).unwrap();
    let names: Vec<String> =
        layout::dimensions(&described.data).into_iter().map(|d| d.name).collect();
    assert_eq!(names, ["height", "own"]);
    let slab = reader.read_all().unwrap();
    let points: Vec<las::Point> = slab.points().collect::<Result<_, _>>().unwrap();
    assert_eq!([points[2].x, points[2].y, points[2].z], [500_001.5, 4_000_001.0, 111.0]);
    let classes: Vec<u8> = points.iter().map(|point| point.classification.into()).collect();
    assert_eq!(classes, [2, 1, 1, 1, 1]);
    assert_eq!((points[0].return_number, points[0].number_of_returns), (1, 2));
    assert_eq!(points[2].extra_bytes, [&11_f32.to_le_bytes()[..], &[1]].concat());
    assert_eq!(points[0].extra_bytes[4], 0);
}

#[test]
fn wrong_tables_are_refused_with_place_and_value() {
    let row = |text: &str| GOOD.replace("2,71\n", text);
    let cases = [
        (row(""), "out.csv has 4 rows, in.laz has 5 points; give every point a tree id"),
        (row("2,71\n2,71\n"), "out.csv, line 5: point 2 comes a second time"),
        (row("5,71\n"), "out.csv, line 4: point `5` must be a whole number from 0 to 4"),
        (row("-1,71\n"), "out.csv, line 4: point `-1` must be a whole number"),
        (row("2,73\n"), "out.csv, line 4: tree id 73 is not in tops.csv; only ids given there"),
        (row("2,71.5\n"), "line 4: tree id 71.5 is not in tops.csv"),
        (row("2,nan\n"), "line 4: tree id NaN is not"),
        (row("2,-1\n"), "line 4: tree id -1 is not"),
        (row("2,oak\n"), "out.csv, line 4: `oak` is no number"),
        (row("2\n"), "out.csv, line 4: `2` has 1 fields, not 2"),
        (
            "point,tree_id,score\n0,0,0\n1,71,1.5\n".to_owned(),
            "line 3: score 1.5 must be a number from 0 to 1",
        ),
        ("0,0\n".to_owned(), "out.csv: begins with `0,0`; the first line must be point,tree_id"),
        (String::new(), "out.csv: is empty"),
        (
            "point,tree_id\n0,\\0377\\0376\n".to_owned(),
            "out.csv: stream did not contain valid UTF-8",
        ),
    ];
    for (text, expected) in cases {
        let said = csv(&text).error();
        assert!(said.contains(expected), "{expected}\nin\n{said}");
    }
}

#[test]
fn missing_double_and_broken_answers_are_refused() {
    let cases = [
        ("true", "neither out.laz nor out.csv"),
        ("touch out.laz out.csv", "both out.laz and out.csv"),
        ("echo rubbish > out.laz", "out.laz: cannot be read as LAZ:"),
        ("head -c 400 in.laz > out.laz", "out.laz: cannot be read as LAZ:"),
        ("cp in.laz out.laz", "out.laz: has no extra dimension `tree_id` (it has: height, own)"),
    ];
    for (script, expected) in cases {
        let said = shell(script, LIMITS).error();
        assert!(said.contains(expected), "{expected}\nin\n{said}");
    }
}

#[test]
fn a_program_that_fails_is_quoted() {
    let ran = shell("echo one; echo 'no module named numpy' >&2; exit 7", LIMITS);
    assert!(ran.log.contains("stdout:\none\nstderr:\nno module named numpy"), "{}", ran.log);
    assert_eq!(
        ran.error(),
        "`the program` failed with exit status: 7; it said: no module named numpy"
    );
    let said = run_words(&["no-such-program-here"], LIMITS, &|| false).error();
    assert!(
        said.starts_with(
            "cannot start `no-such-program-here` (command `the program`): No such file"
        ),
        "{said}"
    );
}

#[test]
fn a_program_that_is_killed_is_named_with_the_signal() {
    let said = shell("kill -9 $$", LIMITS).error();
    assert!(said.contains("`the program` failed with signal: 9 (SIGKILL)"), "{said}");
}

#[test]
fn output_without_end_is_cut() {
    let script = format!(
        "yes error | head -c 30000000 >&2; yes output | head -c 30000000; printf '{}' > out.csv",
        GOOD.replace('\n', "\\n")
    );
    let ran = shell(&script, LIMITS);
    assert!(ran.log.len() < 200_000 && ran.log.contains("bytes left out"), "{}", ran.log.len());
    assert_eq!(ran.ids().len(), POINTS);
}

/// Whether a process lives that was started with an argument.
#[cfg(target_os = "linux")]
fn lives(argument: &str) -> bool {
    let entries = std::fs::read_dir("/proc").unwrap().filter_map(Result::ok);
    let mut lines = entries.filter_map(|entry| std::fs::read(entry.path().join("cmdline")).ok());
    lines.any(|line| line.split(|byte| *byte == 0).any(|word| word == argument.as_bytes()))
}

/// A number of seconds that nobody else sleeps.
#[cfg(target_os = "linux")]
fn nap(more: u32) -> String {
    format!("{}.{more}", 3000 + std::process::id() % 1_000_000)
}

#[cfg(target_os = "linux")]
#[test]
fn what_takes_too_long_is_killed_with_its_children() {
    let naps = [nap(1), nap(2), nap(3)];
    let script = format!(
        "echo working >&2; (sleep {} & sleep {}) & setsid sleep {}",
        naps[0], naps[1], naps[2]
    );
    let begun = Instant::now();
    let ran = shell(&script, Limits { time: Duration::from_millis(400), ..LIMITS });
    assert!(begun.elapsed() < Duration::from_secs(20));
    assert_eq!(naps.iter().filter(|nap| lives(nap)).count(), 0);
    assert!(ran.log.contains("signal: 9") && ran.log.contains("working"), "{}", ran.log);
    let said = ran.error();
    assert!(said.contains("was killed after 0.4 s; raise `command_time_limit_s`"), "{said}");
    assert!(said.ends_with("it said: working"), "{said}");
}

#[cfg(target_os = "linux")]
#[test]
fn children_do_not_outlive_a_good_program() {
    let nap = nap(4);
    let text = GOOD.replace('\n', "\\n");
    let begun = Instant::now();
    let ran = shell(&format!("sleep {nap} & printf '{text}' > out.csv"), LIMITS);
    assert!(begun.elapsed() < Duration::from_secs(20), "its output is not waited for");
    assert_eq!(ran.ids().len(), POINTS);
    assert!(!lives(&nap));
}

#[cfg(target_os = "linux")]
#[test]
fn what_takes_too_much_memory_is_killed_with_its_children() {
    // Without an end of line, `tail` keeps all it reads.
    let limits = Limits { memory_bytes: 80_000_000, ..LIMITS };
    let said = shell("(tail /dev/zero; echo) & wait", limits).error();
    let used = said.split("for using ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    assert!(used.parse::<u32>().unwrap() > 80, "{said}");
    assert!(
        said.contains("MB of memory, more than 80 MB; raise `command_memory_limit_mb`"),
        "{said}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_stopped_run_stops_the_program() {
    let nap = nap(5);
    let begun = Instant::now();
    let late = || begun.elapsed() > Duration::from_millis(200);
    let ran = run_words(&["/bin/sh", "-c", &format!("sleep {nap}; true")], LIMITS, &late);
    assert!(matches!(ran.answer, Err(Failure::Cancelled)));
    assert_eq!(ran.error(), "stopped on request");
    assert!(begun.elapsed() < Duration::from_secs(20) && !lives(&nap));
}

/// An answer in LAZ: in.laz with other extra bytes.
fn laz_answer(
    dimensions: &[(&str, u8)],
    extra: &dyn Fn(usize) -> Vec<u8>,
    points: &[usize],
) -> Result<Answer, Failure> {
    let question = Question::new();
    let folder = tempfile::tempdir().unwrap();
    let given = folder.path().join("in.laz");
    give::points(&question.request(), &given).unwrap();
    let mut reader = las::Reader::from_path(&given).unwrap();
    let slab = reader.read_all().unwrap();
    let given: Vec<las::Point> = slab.points().collect::<Result<_, _>>().unwrap();
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6).unwrap();
    builder.point_format.is_compressed = true;
    builder.point_format.extra_bytes = extra(0).len() as u16;
    builder.transforms = *reader.header().transforms();
    let data =
        dimensions.iter().flat_map(|(name, kind)| layout::descriptor(name, *kind, "")).collect();
    let user_id = layout::USER.to_owned();
    builder.vlrs =
        vec![las::Vlr { user_id, record_id: layout::RECORD, description: String::new(), data }];
    let path = folder.path().join("out.laz");
    let mut writer = las::Writer::from_path(&path, builder.into_header().unwrap()).unwrap();
    for index in points {
        let point = las::Point { extra_bytes: extra(*index), ..given[*index].clone() };
        writer.write_point(point).unwrap();
    }
    drop(writer);
    take::take(folder.path(), &question.request())
}

const IDS: [i64; POINTS] = [0, 71, 71, 71, 72];

#[test]
fn laz_answers_of_several_types() {
    let ids: Vec<u64> = IDS.iter().map(|id| *id as u64).collect();
    let all = [0, 1, 2, 3, 4];
    let whole = laz_answer(&[("tree_id", 8)], &|i| IDS[i].to_le_bytes().to_vec(), &all).unwrap();
    assert_eq!(whole, Answer { tree_id: ids.clone(), score: None });
    let small = laz_answer(&[("tree_id", 1)], &|i| vec![IDS[i] as u8], &all).unwrap();
    assert_eq!(small.tree_id, ids);
    let extra =
        |i: usize| [&[9][..], &(IDS[i] as f64).to_le_bytes(), &0.75_f32.to_le_bytes()].concat();
    let real = laz_answer(&[("own", 1), ("treeID", 10), ("score", 9)], &extra, &all).unwrap();
    assert_eq!(real, Answer { tree_id: ids, score: Some(vec![0.75; POINTS]) });
}

#[test]
fn wrong_laz_answers_are_refused_with_place_and_value() {
    let bytes = |i: usize| IDS[i].to_le_bytes().to_vec();
    let all = [0, 1, 2, 3, 4];
    let said = |answer: Result<Answer, Failure>| answer.unwrap_err().to_string();
    let short = said(laz_answer(&[("tree_id", 8)], &bytes, &all[..4]));
    assert_eq!(
        short,
        "out.laz has 4 points, in.laz has 5 points; give every point a tree id, 0 for none"
    );
    let turned = said(laz_answer(&[("tree_id", 8)], &bytes, &[0, 2, 1, 3, 4]));
    assert!(
        turned.starts_with("out.laz, record 1 (from 0): is at 500001.500 4000001.000 111.000"),
        "{turned}"
    );
    let foreign =
        said(laz_answer(&[("tree_id", 8)], &|i| (IDS[i] + 1).to_le_bytes().to_vec(), &all));
    assert!(
        foreign.contains("out.laz, record 0 (from 0): tree id 1 is not in tops.csv"),
        "{foreign}"
    );
    let short = said(laz_answer(&[("a", 1), ("tree_id", 8)], &bytes, &all));
    assert!(short.contains("`tree_id` lies beyond the record"), "{short}");
}
