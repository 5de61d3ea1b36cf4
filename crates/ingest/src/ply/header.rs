//! The header of a PLY file.
//!
//! G. Turk, "The PLY Polygon File Format" (1994): lines `element NAME COUNT`, each followed by its
//! `property TYPE NAME` and `property list TYPE TYPE NAME`, up to `end_header`.

use crate::Error;
use crate::extra::Stored;
use crate::source::Source;
use crate::table::shown;

/// Longer headers are none.
const MAX_HEADER: u64 = 1 << 20;
const REMEDY: &str = "repair the header, or save the file again as binary PLY";

/// How the data are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    Little,
    Big,
}

/// A property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Property {
    Scalar {
        stored: Stored,
        name: String,
    },
    /// Type of the count, type of the items.
    List {
        count: Stored,
        item: Stored,
    },
}

/// An element: a kind of thing, and how many there are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

impl Element {
    /// Bytes of one, if all of them have the same.
    pub(crate) fn record_len(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, property| match property {
            Property::Scalar { stored, .. } => Some(sum + stored.len()),
            Property::List { .. } => None,
        })
    }
}

/// What the header says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
    /// Where the data begin, and how many lines come before.
    pub(crate) data_at: u64,
    pub(crate) lines: u64,
    pub(crate) newline: u8,
}

impl Header {
    /// Reads the header at the beginning of a source.
    ///
    /// # Errors
    /// [`Error::Content`] naming the line.
    pub(crate) fn read(source: &mut dyn Source) -> Result<Self, Error> {
        let mut bytes = vec![0; source.byte_len()?.min(MAX_HEADER) as usize];
        source.read_at(0, &mut bytes, "the header")?;
        let lone_return = bytes.starts_with(b"ply\r") && bytes.get(4) != Some(&b'\n');
        let newline = if lone_return { b'\r' } else { b'\n' };
        let mut header =
            Self { encoding: Encoding::Ascii, elements: Vec::new(), data_at: 0, lines: 0, newline };
        let mut format = None;
        for line in bytes.split_inclusive(|byte| *byte == newline) {
            header.lines += 1;
            header.data_at += line.len() as u64;
            let text = String::from_utf8_lossy(line);
            let words: Vec<&str> = text.split_whitespace().collect();
            match header.take(&words, &mut format) {
                Ok(true) => return header.checked(format),
                Ok(false) => {}
                Err(problem) => return Err(header.refuse(line, problem)),
            }
        }
        Err(header.refuse(&[], "the header does not end with `end_header`".to_owned()))
    }

    /// Takes in a line; whether it was the last.
    fn take(&mut self, words: &[&str], format: &mut Option<Encoding>) -> Result<bool, String> {
        match words {
            ["end_header"] => return Ok(true),
            ["format", name, version] => {
                *format = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => return Err(format!("format `{other}` is not known")),
                });
                if *version != "1.0" {
                    return Err(format!("version {version} is not known, expected 1.0"));
                }
            }
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("`{count}` is no count"))?;
                let name = (*name).to_owned();
                self.elements.push(Element { name, count, properties: Vec::new() });
            }
            ["property", "list", count, item, _] => {
                let list = Property::List { count: stored(count)?, item: stored(item)? };
                self.element()?.properties.push(list);
            }
            ["property", kind, name @ ..] if !name.is_empty() => {
                let scalar = Property::Scalar { stored: stored(kind)?, name: name.join(" ") };
                self.element()?.properties.push(scalar);
            }
            ["ply" | "comment" | "obj_info", ..] | [] => {}
            _ => return Err("expected `element`, `property` or `comment`".to_owned()),
        }
        Ok(false)
    }

    fn element(&mut self) -> Result<&mut Element, String> {
        self.elements.last_mut().ok_or_else(|| "a property before any element".to_owned())
    }

    fn checked(mut self, format: Option<Encoding>) -> Result<Self, Error> {
        let missing =
            || self.refuse(&[], "no line `format` says how the data are written".to_owned());
        self.encoding = format.ok_or_else(missing)?;
        Ok(self)
    }

    fn refuse(&self, line: &[u8], problem: String) -> Error {
        let found = if line.is_empty() {
            String::new()
        } else {
            format!("`{}`: ", shown(line.trim_ascii()))
        };
        Error::Content {
            place: format!("PLY header, line {}", self.lines),
            problem: format!("{found}{problem}"),
            remedy: REMEDY,
        }
    }
}

fn stored(name: &str) -> Result<Stored, String> {
    Ok(match name {
        "char" | "int8" => Stored::I8,
        "uchar" | "uint8" => Stored::U8,
        "short" | "int16" => Stored::I16,
        "ushort" | "uint16" => Stored::U16,
        "int" | "int32" => Stored::I32,
        "uint" | "uint32" => Stored::U32,
        "int64" => Stored::I64,
        "uint64" => Stored::U64,
        "float" | "float32" => Stored::F32,
        "double" | "float64" => Stored::F64,
        other => return Err(format!("type `{other}` is not known")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn read(text: &str) -> Result<Header, Error> {
        Header::read(&mut Cursor::new(text.as_bytes().to_vec()))
    }

    #[test]
    fn elements_and_properties_are_taken_apart() {
        let text = "ply\r\nformat binary_big_endian 1.0\r\ncomment a b\r\nelement vertex 3\r\nproperty double x\r\n\
                    property list uchar int n\r\nelement face 0\r\nend_header\r\nDATA";
        let header = read(text).unwrap();
        assert_eq!((header.encoding, header.lines), (Encoding::Big, 8));
        assert_eq!(&text[header.data_at as usize..], "DATA");
        assert_eq!((header.elements[0].count, header.elements[0].record_len()), (3, None));
        assert_eq!(header.elements[1].record_len(), Some(0));
        let old = read("ply\rformat ascii 1.0\relement vertex 1\rend_header\r1").unwrap();
        assert_eq!((old.newline, old.data_at), (b'\r', 49));
    }

    #[test]
    fn faults_name_their_line() {
        let check = |text: &str, part: &str| {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(part), "{message}");
        };
        check(
            "ply\nformat ascii 1.0\nelement vertex -3\n",
            "line 3: `element vertex -3`: `-3` is no count",
        );
        check(
            "ply\nproperty float x\n",
            "line 2: `property float x`: a property before any element",
        );
        check("ply\nformat ascii 1.0\nelement v 1\nproperty quad x\n", "type `quad` is not known");
        check("ply\nformat ascii 1.0\n", "does not end with `end_header`");
        check("ply\nelement v 1\nend_header\n", "no line `format`");
        check("ply\nformat ascii 2.0\n", "version 2.0");
    }
}
