//! Tells other kinds of files by their first bytes, so that a refusal says what was given.

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
    let text = |b: &u8| matches!(b, b'\t' | b'\n' | b'\r' | 0x20..=0x7E);
    if bytes.iter().all(text) {
        return "a text file".to_owned();
    }
    let shown: Vec<String> = bytes.iter().take(8).map(|b| format!("{b:02x}")).collect();
    format!("an unknown kind of file (it begins with {})", shown.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_decide() {
        assert_eq!(describe(b"ASTM-E57\x01"), "an E57 file");
        assert_eq!(describe(b"1.0 2.0 3.0\n"), "a text file");
        assert_eq!(describe(&[1, 2, 0xAB]), "an unknown kind of file (it begins with 01 02 ab)");
    }
}
