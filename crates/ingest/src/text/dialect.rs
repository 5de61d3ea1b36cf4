//! How a text file is written: separator, decimal mark, header lines, where the rows begin.

use crate::Error;
use crate::attributes::{missing_axes, roles_of};
use crate::table::{Separator, Values, is_comment, number, shown, whole_number};

/// Header lines of any kind before the first row.
const MAX_HEADER_LINES: usize = 200;
/// Of the lines after the first row, at least this share must be rows: other texts hold a table
/// now and then.
const ROW_SHARE: f64 = 0.8;
const REMEDY: &str = "one point a line is expected, with x, y, z first or named by a header line; \
                      convert the file, or leave it out of the campaign's inputs";

/// How the rows of a file are written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dialect {
    pub(crate) separator: Separator,
    pub(crate) decimal_comma: bool,
    pub(crate) newline: u8,
    /// Byte at which the rows begin, and how many lines come before.
    pub(crate) data_at: u64,
    pub(crate) data_line: u64,
    /// Names of the columns, where the file gives them.
    pub(crate) names: Option<Vec<String>>,
    /// Values of most rows.
    pub(crate) width: usize,
    /// Number of points that a line before the rows promises, and that line's number from 1.
    pub(crate) count: Option<(u64, u64)>,
    pub(crate) notes: Vec<String>,
}

/// A line of the sample.
#[derive(Debug, Clone, Copy)]
struct Line<'a> {
    at: usize,
    /// From 0.
    number: u64,
    text: &'a [u8],
}

/// The ways to write rows, the most telling first: where two explain a line, the first is meant.
const WAYS: [(Separator, bool); 7] = [
    (Separator::Char(b';'), false),
    (Separator::Char(b';'), true),
    (Separator::Char(b'\t'), false),
    (Separator::Char(b'\t'), true),
    (Separator::Blanks, false),
    (Separator::Blanks, true),
    (Separator::Char(b','), false),
];

impl Dialect {
    /// Finds out from the first bytes of a file; `whole` when they are all of it.
    ///
    /// # Errors
    /// [`Error::Foreign`] or [`Error::Content`] for what is no point cloud.
    pub(crate) fn of(sample: &[u8], whole: bool) -> Result<Self, Error> {
        let newline = if sample.contains(&b'\n') { b'\n' } else { b'\r' };
        let lines = lines(sample, newline, whole);
        refuse_others(&lines)?;
        let (separator, decimal_comma) = way(&lines).ok_or_else(|| no_rows(&lines))?;
        let is_row = |line: &&Line<'_>| {
            !is_comment(line.text) && numbers_in(line.text, separator, decimal_comma) >= 3
        };
        let first = lines.iter().position(|line| is_row(&line)).ok_or_else(|| no_rows(&lines))?;
        let body = lines[first..].iter().filter(|line| is_data(line));
        let (rows, all) = (body.clone().filter(is_row).count(), body.count());
        let width = width(&lines[first..], separator);
        // Short lines may be most without being a fifth of all.
        let few = (rows as f64) < ROW_SHARE * all as f64 || width < 3;
        if few || first > MAX_HEADER_LINES {
            return Err(no_rows(&lines));
        }
        let mut dialect = Self {
            separator,
            decimal_comma,
            newline,
            data_at: lines[first].at as u64,
            data_line: lines[first].number,
            names: None,
            width,
            count: None,
            notes: Vec::new(),
        };
        dialect.read_header(&lines[..first])?;
        Ok(dialect)
    }

    fn values<'a>(&self, text: &'a [u8]) -> Values<'a> {
        Values { rest: text, separator: self.separator }
    }

    /// Names and counts in the lines before the rows.
    fn read_header(&mut self, lines: &[Line<'_>]) -> Result<(), Error> {
        let mut titles = 0;
        for (index, line) in lines.iter().enumerate().rev() {
            let alone = whole_number(line.text).filter(|_| !is_comment(line.text));
            if let Some(count) = alone {
                self.count = self.count.or(Some((count, line.number + 1)));
            } else if self.names.is_none()
                && let Some(names) = self.names_in(line.text)
            {
                self.check_names(&names, line)?;
                self.names = Some(names);
            } else if is_data(line) && self.names.is_none() {
                let last = !lines[index + 1..].iter().any(is_data);
                self.refuse_other_header(line, last)?;
                titles += 1;
            }
        }
        if titles > 0 {
            self.notes.push(format!("{titles} lines before the first row name no columns"));
        }
        Ok(())
    }

    /// The names in a line, if x, y and z are among them.
    fn names_in(&self, text: &[u8]) -> Option<Vec<String>> {
        let text = text.trim_ascii_start();
        let comment = is_comment(text);
        let text = match comment {
            true => text.trim_ascii_start().strip_prefix(b"//").unwrap_or(&text[1..]),
            false => text,
        };
        // In a comment names may stand between other separators than the values.
        let separators = [Separator::Char(b','), self.separator, Separator::Blanks];
        let tried = if comment { &separators[..] } else { &separators[1..2] };
        tried.iter().find_map(|separator| {
            let values = Values { rest: text.trim_ascii(), separator: *separator };
            let names: Vec<String> =
                values.map(|name| String::from_utf8_lossy(name).into_owned()).collect();
            missing_axes(&roles_of(names.iter().map(String::as_str))).is_empty().then_some(names)
        })
    }

    fn check_names(&self, names: &[String], line: &Line<'_>) -> Result<(), Error> {
        if names.len() <= self.width {
            return Ok(());
        }
        Err(Error::Content {
            place: format!("line {}", line.number + 1),
            problem: format!("it names {} columns, the rows have {}", names.len(), self.width),
            remedy: "give every column a value, or name only those that are there",
        })
    }

    /// A table whose header names other things than x, y and z is no point cloud.
    fn refuse_other_header(&self, line: &Line<'_>, last: bool) -> Result<(), Error> {
        let names: Vec<String> =
            self.values(line.text).map(|n| String::from_utf8_lossy(n).into_owned()).collect();
        if !last || names.len() != self.width {
            return Ok(());
        }
        let missing = missing_axes(&roles_of(names.iter().map(String::as_str)));
        Err(Error::Content {
            place: format!("line {}", line.number + 1),
            problem: format!(
                "a table without a column {}: `{}`",
                missing.join(", "),
                shown(line.text)
            ),
            remedy: REMEDY,
        })
    }
}

/// The lines of a sample that are not blank; the last is left out when it may go on.
fn lines(sample: &[u8], newline: u8, whole: bool) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    let mut at = 0;
    for (number, text) in (0..).zip(sample.split(|byte| *byte == newline)) {
        let trimmed = text.trim_ascii();
        if !trimmed.is_empty() && (whole || at + text.len() < sample.len()) {
            lines.push(Line { at, number, text: trimmed });
        }
        at += text.len() + 1;
    }
    lines
}

/// Neither comment nor count.
fn is_data(line: &Line<'_>) -> bool {
    !is_comment(line.text) && whole_number(line.text).is_none()
}

/// How many values of a line are numbers.
fn numbers_in(text: &[u8], separator: Separator, decimal_comma: bool) -> usize {
    let values = Values { rest: text, separator };
    values.filter(|value| number(value, decimal_comma).is_some()).count()
}

/// The way that explains most values, in lines of at least three numbers.
fn way(lines: &[Line<'_>]) -> Option<(Separator, bool)> {
    const LINES: usize = 400;
    let data: Vec<&Line<'_>> = lines.iter().filter(|line| is_data(line)).take(LINES).collect();
    let explained = |(separator, comma): (Separator, bool)| {
        let numbers = data.iter().map(|line| numbers_in(line.text, separator, comma));
        numbers.filter(|numbers| *numbers >= 3).sum::<usize>()
    };
    let counts = WAYS.map(explained);
    let most = counts.into_iter().max().filter(|most| *most > 0)?;
    counts.iter().position(|count| *count == most).map(|index| WAYS[index])
}

/// The number of values that most rows have; the smallest of several.
fn width(lines: &[Line<'_>], separator: Separator) -> usize {
    let mut widths: Vec<usize> = lines
        .iter()
        .filter(|line| is_data(line))
        .map(|line| Values { rest: line.text, separator }.count())
        .collect();
    widths.sort_unstable();
    let runs = widths.chunk_by(|a, b| a == b).rev();
    runs.max_by_key(|run| run.len()).map_or(0, |run| run[0])
}

fn no_rows(lines: &[Line<'_>]) -> Error {
    let first = lines.first().map_or("", |line| std::str::from_utf8(line.text).unwrap_or(""));
    let found = match lines.is_empty() {
        true => "a text file without a line".to_owned(),
        false => format!("a text file without rows of numbers (`{}`)", shown(first.as_bytes())),
    };
    Error::Foreign { found }
}

/// Other formats that are texts.
fn refuse_others(lines: &[Line<'_>]) -> Result<(), Error> {
    let Some(first) = lines.first() else { return Ok(()) };
    let starts = |word: &str| {
        first.text.get(..word.len()).is_some_and(|t| t.eq_ignore_ascii_case(word.as_bytes()))
    };
    let others = [
        ("ncols", "an ESRI ASCII raster"),
        ("<", "an XML or HTML file"),
        ("{", "a JSON file"),
        ("solid", "an STL mesh"),
        ("OFF", "an OFF mesh"),
        ("v ", "an OBJ mesh"),
    ];
    let ptx = lines.len() > 2 && lines[..2].iter().all(|line| whole_number(line.text).is_some());
    let other = others.iter().find(|(word, _)| starts(word)).map(|(_, name)| *name);
    match other.or(ptx.then_some("a PTX file (save it as E57 or PTS)")) {
        Some(found) => Err(Error::Foreign { found: found.to_owned() }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, separator: Separator, comma: bool, line: u64, names: &[&str]) -> Dialect {
        let dialect = Dialect::of(text.as_bytes(), true).unwrap();
        assert_eq!((dialect.separator, dialect.decimal_comma), (separator, comma), "{text}");
        assert_eq!(dialect.data_line, line, "{text}");
        assert_eq!(dialect.names.clone().unwrap_or_default(), names, "{text}");
        dialect
    }

    fn refused(text: &str) -> String {
        Dialect::of(text.as_bytes(), true).unwrap_err().to_string()
    }

    #[test]
    fn separators_and_headers_are_found() {
        use Separator::{Blanks, Char};
        check("1 2 3\n4 5 6\n", Blanks, false, 0, &[]);
        check("x,y,z\n1.0,2.0,3.0\n", Char(b','), false, 1, &["x", "y", "z"]);
        check("1, 2, 3\n4, 5, 6", Char(b','), false, 0, &[]);
        check("X;Y;Z;Art\n1,5;2,5;3;Oak\n", Char(b';'), true, 1, &["X", "Y", "Z", "Art"]);
        check("1,5 2,5 3,25\n", Blanks, true, 0, &[]);
        check("1.5\t2\t\t7\n1\t2\t3\t4\n", Char(b'\t'), false, 0, &[]);
        check(
            "//X Y Z Intensity\n2\n1 2 3 4\n1 2 3 4\n",
            Blanks,
            false,
            2,
            &["X", "Y", "Z", "Intensity"],
        );
        check("# x, y, z\r\n1 2 3\r\n", Blanks, false, 1, &["x", "y", "z"]);
        check("1 2 3\r4 5 6\r", Blanks, false, 0, &[]);
    }

    #[test]
    fn counts_and_titles_are_told_from_rows() {
        let pts = check("3\n1 2 3 -400 1 2 3\n1 2 3 5 1 2 3\n", Separator::Blanks, false, 1, &[]);
        assert_eq!((pts.count, pts.width, pts.data_at), (Some((3, 1)), 7, 2));
        let titled =
            check("Plot seven\nx y z\n1 2 3\n", Separator::Blanks, false, 2, &["x", "y", "z"]);
        assert!(titled.notes.is_empty());
        let titled = check("Scan of plot\n1 2 3 4\n", Separator::Blanks, false, 1, &[]);
        assert_eq!(titled.notes.len(), 1);
    }

    #[test]
    fn other_texts_are_refused() {
        assert!(refused("ncols 3\nnrows 2\n1 2 3\n1 2 3\n").contains("an ESRI ASCII raster"));
        assert!(refused("2\n3\n0 0 0\n1 0 0\n").contains("a PTX file"));
        assert!(
            refused("A story of trees\nwith 3 lines\nand 1 2 3\nand no more\n")
                .contains("without rows")
        );
        let trees = refused("id,dbh,height\n1,0.3,20\n2,0.25,21\n");
        assert!(trees.contains("line 1: a table without a column x, y, z"), "{trees}");
        let names = refused("x y z class\n1 2 3\n4 5 6\n");
        assert!(names.contains("names 4 columns, the rows have 3"), "{names}");
        assert!(refused("").contains("without a line"));
        // Found by fuzzing: the commonest line was shorter than x y z.
        let short = "1 2 3 4\n1 2 3\n1 2 3 4 5\n1 2 3 4 5 6\n1 2 3 4 5 6 7\n1 2 3 4 5 6 7 8\n1 2 3 4 5 6 7 8 9\n1 2 3 4 5 6 7 8 9 10\na b\nc d\n";
        assert!(refused(short).contains("without rows"));
    }
}
