//! Tells kinds of files by their first bytes: what can be read, and what a refusal says was given.

use crate::Error;
use crate::source::Source;

/// A format that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    /// LAS, LAZ or COPC; also whatever is none of the others.
    Las,
    E57,
    Ply,
    Pcd,
    Text,
}

/// Bytes looked at.
const BEGINNING: u64 = 1 << 12;

/// The format of a file.
///
/// # Errors
/// [`Error::Io`].
pub(crate) fn format(source: &mut dyn Source) -> Result<Format, Error> {
    let mut bytes = vec![0; source.byte_len()?.min(BEGINNING) as usize];
    source.read_at(0, &mut bytes, "the beginning")?;
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    Ok(if starts(b"ASTM-E57") {
        Format::E57
    } else if starts(b"ply\n") || starts(b"ply\r") {
        Format::Ply
    } else if is_pcd(&bytes) {
        Format::Pcd
    } else if is_text(&bytes) {
        Format::Text
    } else {
        Format::Las
    })
}

/// Comments, then `VERSION` or, in old files, `FIELDS`.
fn is_pcd(bytes: &[u8]) -> bool {
    let mut lines = bytes.split(|byte| *byte == b'\n');
    let first = lines.find(|line| !line.starts_with(b"#") && !line.trim_ascii().is_empty());
    first.is_some_and(|line| line.starts_with(b"VERSION ") || line.starts_with(b"FIELDS "))
}

/// Printed characters, in any encoding that has ASCII among them.
fn is_text(bytes: &[u8]) -> bool {
    let text = |byte: &u8| matches!(byte, b'\t' | b'\n' | b'\r' | 0x0C | 0x20..=0x7E | 0x80..);
    let ascii = bytes.iter().filter(|byte| byte.is_ascii()).count();
    bytes.iter().all(text) && 10 * ascii >= 9 * bytes.len() && !bytes.is_empty()
}

/// First bytes and what they mean.
const KNOWN: [(&[u8], &str); 15] = [
    (b"ASTM-E57", "an E57 file"),
    (b"# .PCD", "a PCD file"),
    (b"VERSION ", "a PCD file"),
    (b"ply\n", "a PLY file"),
    (b"ply\r\n", "a PLY file"),
    (b"\x89PNG", "a PNG image"),
    (b"\xFF\xD8\xFF", "a JPEG image"),
    (b"II*\0", "a TIFF image"),
    (b"MM\0*", "a TIFF image"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1F\x8B", "a gzip archive"),
    (b"LASX", "a LAX spatial index"),
    (b"SQLite format 3\0", "an SQLite or GeoPackage file"),
    (b"TMBRLINE", "an artefact of Timberline"),
    (b"\x89MCAP", "an MCAP file"),
];

/// A name for what the first bytes of a file look like.
#[must_use]
pub(crate) fn describe(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        return "an empty file".to_owned();
    }
    if let Some((_, name)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return (*name).to_owned();
    }
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return "a text of 16-bit characters (save it as UTF-8)".to_owned();
    }
    if is_text(bytes) {
        return "a text file".to_owned();
    }
    let shown: Vec<String> = bytes.iter().take(8).map(|b| format!("{b:02x}")).collect();
    format!("an unknown kind of file (it begins with {})", shown.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_told_by_contents() {
        let check = |bytes: &[u8], expected: Format| {
            let found = format(&mut std::io::Cursor::new(bytes.to_vec())).unwrap();
            assert_eq!(found, expected, "{}", String::from_utf8_lossy(bytes));
        };
        check(b"ASTM-E57\x01\0", Format::E57);
        check(b"ply\r\nformat", Format::Ply);
        check(b"# .PCD v0.7\nVERSION 0.7\n", Format::Pcd);
        check(b"VERSION .5\n", Format::Pcd);
        check(b"# x y z\n1 2 3\n", Format::Text);
        check("# H\u{f6}he\n1 2 3 4 5 6 7\n".as_bytes(), Format::Text);
        check(b"LASF\0\0", Format::Las);
        check(b"", Format::Las);
        check(&[0xFF, 0xFE, b'1', 0], Format::Las);
    }

    #[test]
    fn contents_decide() {
        assert_eq!(describe(b"ASTM-E57\x01"), "an E57 file");
        assert_eq!(describe(b"1.0 2.0 3.0\n"), "a text file");
        assert_eq!(describe(&[1, 2, 0xAB]), "an unknown kind of file (it begins with 01 02 ab)");
    }
}
