//! The file of a table or model: payload, header, trailer.
//!
//! ```text
//! 0            8  magic "TMBRLINE"
//! 8            4  container version, little-endian
//! 12           P  payload
//! 12+P         H  header, JSON
//! 12+P+H       8  P
//!              8  xxh3 of the payload
//!              8  H
//!              8  xxh3 of magic, version, the three numbers above and the header
//!              8  end magic "TMBREND\n"
//! ```
//! The header comes last so that a payload can be written as a stream whose counts are known only
//! at its end. Every byte is covered by one of the two checksums or by a magic.

use crate::{Error, Header};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// First bytes of every table artefact.
pub const MAGIC: [u8; 8] = *b"TMBRLINE";
const END_MAGIC: [u8; 8] = *b"TMBREND\n";
/// Raise it when this layout changes; every artefact is then rebuilt.
pub const CONTAINER_VERSION: u32 = 1;
/// Bytes before the payload.
pub const PREFIX_LEN: u64 = 12;
const TRAILER_LEN: u64 = 40;
/// No header is longer; a larger claim is corruption.
const MAX_HEADER_LEN: u64 = 1 << 28;

/// Writes one artefact as a stream. Dropped without [`ContainerWriter::finish`] it leaves no valid file.
pub struct ContainerWriter<W: Write> {
    out: W,
    hash: Xxh3,
    payload_len: u64,
}

impl<W: Write> ContainerWriter<W> {
    /// Begins the file.
    ///
    /// # Errors
    /// The writer's.
    pub fn new(mut out: W) -> std::io::Result<Self> {
        out.write_all(&MAGIC)?;
        out.write_all(&CONTAINER_VERSION.to_le_bytes())?;
        Ok(Self { out, hash: Xxh3::new(), payload_len: 0 })
    }

    /// Bytes of payload written so far: the offset of what comes next.
    #[must_use]
    pub fn payload_len(&self) -> u64 {
        self.payload_len
    }

    /// Ends the file with its header and trailer and returns the writer.
    ///
    /// # Errors
    /// The writer's.
    pub fn finish(mut self, header_json: &[u8]) -> std::io::Result<W> {
        let payload_hash = self.hash.digest();
        let numbers = Numbers {
            payload_len: self.payload_len,
            payload_hash,
            header_len: header_json.len() as u64,
        };
        self.out.write_all(header_json)?;
        self.out.write_all(&numbers.bytes())?;
        self.out.write_all(&numbers.seal(CONTAINER_VERSION, header_json).to_le_bytes())?;
        self.out.write_all(&END_MAGIC)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

impl<W: Write> Write for ContainerWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(&bytes[..written]);
        self.payload_len += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// The three numbers of the trailer.
#[derive(Debug, Clone, Copy)]
struct Numbers {
    payload_len: u64,
    payload_hash: u64,
    header_len: u64,
}

impl Numbers {
    fn bytes(&self) -> [u8; 24] {
        let mut bytes = [0; 24];
        bytes[..8].copy_from_slice(&self.payload_len.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.payload_hash.to_le_bytes());
        bytes[16..].copy_from_slice(&self.header_len.to_le_bytes());
        bytes
    }

    fn seal(&self, version: u32, header_json: &[u8]) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(&MAGIC);
        hash.update(&version.to_le_bytes());
        hash.update(&self.bytes());
        hash.update(header_json);
        hash.digest()
    }
}

/// An open table artefact whose header and trailer have been checked.
#[derive(Debug)]
pub struct ContainerReader {
    path: PathBuf,
    file: File,
    header: Header,
    numbers: Numbers,
}

impl ContainerReader {
    /// Opens a file and checks everything but the payload.
    ///
    /// # Errors
    /// [`Error::Foreign`], [`Error::Version`], [`Error::Corrupt`] or [`Error::Io`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = File::open(path).map_err(Error::io(path, "open"))?;
        let len = file.metadata().map_err(Error::io(path, "read"))?.len();
        let version = check_prefix(path, &mut file, len)?;
        if len < PREFIX_LEN + TRAILER_LEN {
            return Err(Error::corrupt(
                path,
                "trailer",
                format!("the file ends after {len} bytes"),
            ));
        }
        let (numbers, seal) = read_trailer(path, &mut file, len)?;
        let mut json = vec![0; numbers.header_len as usize];
        read_at(path, &mut file, PREFIX_LEN + numbers.payload_len, &mut json)?;
        let found = numbers.seal(version, &json);
        if found != seal {
            let detail = format!("checksum {found:016x}, expected {seal:016x}");
            return Err(Error::corrupt(path, "header", detail));
        }
        let header = serde_json::from_slice(&json)
            .map_err(|error| Error::corrupt(path, "header", error.to_string()))?;
        Ok(Self { path: path.to_path_buf(), file, header, numbers })
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The header alone.
    #[must_use]
    pub fn into_header(self) -> Header {
        self.header
    }

    /// Number of payload bytes.
    #[must_use]
    pub fn payload_len(&self) -> u64 {
        self.numbers.payload_len
    }

    /// The whole payload, checked.
    ///
    /// # Errors
    /// [`Error::Corrupt`] when the checksum does not fit.
    pub fn payload(&mut self) -> Result<Vec<u8>, Error> {
        let mut bytes = vec![0; self.numbers.payload_len as usize];
        read_at(&self.path, &mut self.file, PREFIX_LEN, &mut bytes)?;
        let mut hash = Xxh3::new();
        hash.update(&bytes);
        self.check_payload_hash(hash.digest())?;
        Ok(bytes)
    }

    /// Checks the payload without holding it in memory.
    ///
    /// # Errors
    /// [`Error::Corrupt`] when the checksum does not fit.
    pub fn verify_payload(&mut self) -> Result<(), Error> {
        let (mut hash, mut buffer) = (Xxh3::new(), vec![0; 1 << 20]);
        let mut done = 0;
        while done < self.numbers.payload_len {
            let step = (self.numbers.payload_len - done).min(buffer.len() as u64) as usize;
            read_at(&self.path, &mut self.file, PREFIX_LEN + done, &mut buffer[..step])?;
            hash.update(&buffer[..step]);
            done += step as u64;
        }
        self.check_payload_hash(hash.digest())
    }

    /// A part of the payload, **not** checked: for kinds whose parts carry their own checksums.
    ///
    /// # Errors
    /// [`Error::Corrupt`] when the part lies outside the payload.
    pub fn section(&mut self, offset: u64, len: u64) -> Result<Vec<u8>, Error> {
        let end = offset.checked_add(len).filter(|end| *end <= self.numbers.payload_len);
        if end.is_none() {
            let detail = format!(
                "bytes {offset}+{len} lie outside the payload of {}",
                self.numbers.payload_len
            );
            return Err(Error::corrupt(&self.path, "section", detail));
        }
        let mut bytes = vec![0; len as usize];
        read_at(&self.path, &mut self.file, PREFIX_LEN + offset, &mut bytes)?;
        Ok(bytes)
    }

    fn check_payload_hash(&self, found: u64) -> Result<(), Error> {
        let expected = self.numbers.payload_hash;
        if found == expected {
            return Ok(());
        }
        let detail = format!("checksum {found:016x}, expected {expected:016x}");
        Err(Error::corrupt(&self.path, "payload", detail))
    }
}

fn check_prefix(path: &Path, file: &mut File, len: u64) -> Result<u32, Error> {
    let mut prefix = [0; PREFIX_LEN as usize];
    let have = len.min(PREFIX_LEN) as usize;
    read_at(path, file, 0, &mut prefix[..have])?;
    if have < prefix.len() || prefix[..8] != MAGIC {
        let found = format!("it begins with {:?}", String::from_utf8_lossy(&prefix[..have.min(8)]));
        return Err(Error::Foreign { path: path.to_path_buf(), found });
    }
    let found = u32::from_le_bytes([prefix[8], prefix[9], prefix[10], prefix[11]]);
    if found == CONTAINER_VERSION {
        return Ok(found);
    }
    let what = "container".to_owned();
    Err(Error::Version { path: path.to_path_buf(), what, found, supported: &[CONTAINER_VERSION] })
}

fn read_trailer(path: &Path, file: &mut File, len: u64) -> Result<(Numbers, u64), Error> {
    let mut trailer = [0; TRAILER_LEN as usize];
    read_at(path, file, len - TRAILER_LEN, &mut trailer)?;
    if trailer[32..] != END_MAGIC {
        return Err(Error::corrupt(path, "trailer", "the end mark is missing: cut off or changed"));
    }
    let number = |at: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&trailer[at..at + 8]);
        u64::from_le_bytes(bytes)
    };
    let numbers =
        Numbers { payload_len: number(0), payload_hash: number(8), header_len: number(16) };
    let total = numbers.payload_len.checked_add(numbers.header_len);
    let fits = total.and_then(|sum| sum.checked_add(PREFIX_LEN + TRAILER_LEN)) == Some(len);
    if !fits || numbers.header_len > MAX_HEADER_LEN {
        let detail = format!(
            "payload {} + header {} bytes do not make a file of {len}",
            numbers.payload_len, numbers.header_len
        );
        return Err(Error::corrupt(path, "trailer", detail));
    }
    Ok((numbers, number(24)))
}

fn read_at(path: &Path, file: &mut File, offset: u64, bytes: &mut [u8]) -> Result<(), Error> {
    file.seek(SeekFrom::Start(offset)).map_err(Error::io(path, "seek"))?;
    file.read_exact(bytes).map_err(Error::io(path, "read"))
}
