//! The header of a PCD file, version 0.7 and older.
//!
//! "The PCD (Point Cloud Data) file format", Point Cloud Library: lines of a word and values, up to
//! `DATA`. `FIELDS`, `SIZE`, `TYPE` and `COUNT` describe a point; `POINTS` says how many there are.

use crate::Error;
use crate::extra::Stored;
use crate::source::Source;
use crate::table::shown;

const MAX_HEADER: u64 = 1 << 16;
/// Bytes of a point: no descriptor is longer.
const MAX_RECORD: usize = 1 << 16;
const REMEDY: &str = "repair the header, or save the file again as binary PCD";

/// How the data are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    Binary,
    Compressed,
}

/// A field of a point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) stored: Stored,
    /// Number of values.
    pub(crate) count: usize,
    /// Byte of the record at which it begins.
    pub(crate) at: usize,
}

impl Field {
    /// Bytes of all its values.
    pub(crate) fn len(&self) -> usize {
        self.stored.len() * self.count
    }
}

/// What the header says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) fields: Vec<Field>,
    pub(crate) record_len: usize,
    pub(crate) points: u64,
    /// Position and rotation (w, x, y, z) of the sensor.
    pub(crate) viewpoint: [f64; 7],
    /// Where the data begin, and how many lines come before.
    pub(crate) data_at: u64,
    pub(crate) lines: u64,
    /// What does not fit together.
    pub(crate) notes: Vec<String>,
}

/// Where the sensor stands unless the file says otherwise.
pub(crate) const NO_VIEWPOINT: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// The values of the lines met so far.
#[derive(Debug, Clone, Default)]
struct Draft {
    names: Vec<String>,
    sizes: Vec<usize>,
    types: Vec<char>,
    counts: Vec<usize>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
    viewpoint: Option<[f64; 7]>,
}

impl Header {
    /// Reads the header at the beginning of a source.
    ///
    /// # Errors
    /// [`Error::Content`] naming the line.
    pub(crate) fn read(source: &mut dyn Source) -> Result<Self, Error> {
        let mut bytes = vec![0; source.byte_len()?.min(MAX_HEADER) as usize];
        source.read_at(0, &mut bytes, "the header")?;
        let mut draft = Draft::default();
        let (mut data_at, mut lines) = (0, 0);
        for line in bytes.split_inclusive(|byte| *byte == b'\n') {
            lines += 1;
            data_at += line.len() as u64;
            let text = String::from_utf8_lossy(line);
            let refuse = |problem: String| Error::Content {
                place: format!("PCD header, line {lines}"),
                problem: format!("`{}`: {problem}", shown(line.trim_ascii())),
                remedy: REMEDY,
            };
            if let Some(encoding) = draft.take(&text).map_err(refuse)? {
                return draft.finish(encoding, data_at, lines).map_err(refuse);
            }
        }
        Err(Error::Content {
            place: "PCD header".to_owned(),
            problem: "no line `DATA` ends it".to_owned(),
            remedy: REMEDY,
        })
    }
}

impl Draft {
    /// Takes in a line; how the data are written if it is the last.
    fn take(&mut self, line: &str) -> Result<Option<Encoding>, String> {
        let mut words = line.split_whitespace();
        let Some(key) = words.next() else { return Ok(None) };
        let values: Vec<&str> = words.collect();
        match key {
            "FIELDS" | "COLUMNS" => self.names = values.iter().map(|v| (*v).to_owned()).collect(),
            "SIZE" => self.sizes = numbers(&values)?,
            "TYPE" => self.types = values.iter().filter_map(|value| value.chars().next()).collect(),
            "COUNT" => self.counts = numbers(&values)?,
            "WIDTH" => self.width = numbers(&values)?.first().copied(),
            "HEIGHT" => self.height = numbers(&values)?.first().copied(),
            "POINTS" => self.points = numbers(&values)?.first().copied(),
            "VIEWPOINT" => {
                let values: Vec<f64> = numbers(&values)?;
                self.viewpoint = Some(values.try_into().map_err(|_| "7 values are expected")?);
            }
            "DATA" => {
                return match values.first() {
                    Some(&"ascii") => Ok(Some(Encoding::Ascii)),
                    Some(&"binary") => Ok(Some(Encoding::Binary)),
                    Some(&"binary_compressed") => Ok(Some(Encoding::Compressed)),
                    _ => Err("expected ascii, binary or binary_compressed".to_owned()),
                };
            }
            key if key.starts_with('#') || key == "VERSION" => {}
            _ => return Err("this word is not known".to_owned()),
        }
        Ok(None)
    }

    fn finish(self, encoding: Encoding, data_at: u64, lines: u64) -> Result<Header, String> {
        let len = self.names.len();
        let counts = if self.counts.is_empty() { vec![1; len] } else { self.counts.clone() };
        for (word, found) in
            [("SIZE", self.sizes.len()), ("TYPE", self.types.len()), ("COUNT", counts.len())]
        {
            if found != len {
                return Err(format!("{word} has {found} values, FIELDS has {len}"));
            }
        }
        let (mut fields, mut at) = (Vec::new(), 0usize);
        for (index, name) in self.names.iter().enumerate() {
            let stored = stored(self.types[index], self.sizes[index]).ok_or_else(|| {
                format!("`{name}` has type {} of {} bytes", self.types[index], self.sizes[index])
            })?;
            let field = Field { name: name.clone(), stored, count: counts[index], at };
            let bytes = stored.len().checked_mul(field.count);
            at = bytes.and_then(|bytes| at.checked_add(bytes)).ok_or("the fields are too long")?;
            fields.push(field);
        }
        if at > MAX_RECORD {
            return Err(format!(
                "the fields of a point have {at} bytes, at most {MAX_RECORD} are read"
            ));
        }
        let grid = self.width.and_then(|width| width.checked_mul(self.height.unwrap_or(1)));
        let points =
            self.points.or(grid).ok_or("neither POINTS nor WIDTH says how many there are")?;
        let differ = grid.filter(|grid| *grid != points);
        let notes = differ.map(|grid| {
            format!("WIDTH times HEIGHT is {grid}, POINTS is {points}, which is taken")
        });
        Ok(Header {
            encoding,
            fields,
            record_len: at,
            points,
            viewpoint: self.viewpoint.unwrap_or(NO_VIEWPOINT),
            data_at,
            lines,
            notes: notes.into_iter().collect(),
        })
    }
}

fn numbers<T: std::str::FromStr>(values: &[&str]) -> Result<Vec<T>, String> {
    let number = |value: &&str| value.parse().map_err(|_| format!("`{value}` is no such number"));
    values.iter().map(number).collect()
}

fn stored(kind: char, size: usize) -> Option<Stored> {
    Some(match (kind, size) {
        ('I', 1) => Stored::I8,
        ('I', 2) => Stored::I16,
        ('I', 4) => Stored::I32,
        ('I', 8) => Stored::I64,
        ('U', 1) => Stored::U8,
        ('U', 2) => Stored::U16,
        ('U', 4) => Stored::U32,
        ('U', 8) => Stored::U64,
        ('F', 4) => Stored::F32,
        ('F', 8) => Stored::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const GOOD: &str = "# .PCD v.7\nVERSION .7\nFIELDS x y z n\nSIZE 4 4 8 2\nTYPE F F F U\n\
                        COUNT 1 1 1 3\nWIDTH 5\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 10\nDATA binary\nx";

    fn read(text: &str) -> Result<Header, Error> {
        Header::read(&mut Cursor::new(text.as_bytes().to_vec()))
    }

    #[test]
    fn fields_are_laid_out_one_after_the_other() {
        let header = read(GOOD).unwrap();
        let places: Vec<usize> = header.fields.iter().map(|field| field.at).collect();
        assert_eq!(
            (places.as_slice(), header.record_len, header.points),
            (&[0, 4, 8, 16][..], 22, 10)
        );
        assert_eq!((&GOOD[header.data_at as usize..], header.lines), ("x", 11));
        assert!(header.notes.is_empty());
        let differs = read(&GOOD.replace("HEIGHT 2", "HEIGHT 3")).unwrap();
        assert!(differs.notes[0].contains("15, POINTS is 10"), "{:?}", differs.notes);
        let old = GOOD.replace("POINTS 10\n", "").replace("COUNT 1 1 1 3\n", "");
        assert_eq!(read(&old).unwrap().record_len, 18);
    }

    #[test]
    fn faults_name_their_line() {
        let check = |from: &str, to: &str, part: &str| {
            let message = read(&GOOD.replace(from, to)).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        };
        check("SIZE 4", "SIZE four", "line 4: `SIZE four 4 8 2`: `four` is no such number");
        check("TYPE F F F U", "TYPE F F F", "TYPE has 3 values, FIELDS has 4");
        check("SIZE 4 4", "SIZE 4 3", "`y` has type F of 3 bytes");
        check("DATA binary", "DATA zip", "expected ascii, binary");
        check("DATA binary\nx", "", "no line `DATA`");
        check("WIDTH 5", "WIDE 5", "not known");
    }
}
