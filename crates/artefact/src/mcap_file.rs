//! The file of everything somebody may want to look at: MCAP, with the header as a metadata record.
//!
//! Every message is a chunk of its own (zstd level 1), so that a reader decodes only what it needs.
//! All check sums of the format are written, and all are demanded on reading, also those that the
//! format leaves optional: with the lengths of all records they cover every byte.

use crate::{Error, Header};
use mcap::records::MessageHeader;
use mcap::{Compression, Summary, WriteOptions};
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

/// First and last bytes of every MCAP file.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Name of the metadata record that holds the header.
pub const HEADER_RECORD: &str = "timberline.header";
/// Higher levels gain nothing on shuffled point data.
const ZSTD_LEVEL: u32 = 1;
const OP_DATA_END: u8 = 0x0F;
/// Opcode and length of a record.
const RECORD_PREFIX: usize = 9;
/// Footer record: prefix, two offsets, check sum.
const FOOTER_LEN: usize = RECORD_PREFIX + 20;

/// Writes one MCAP artefact.
pub struct McapWriter<W: Write + Seek> {
    writer: mcap::Writer<W>,
    sequence: u32,
}

fn encode_error(error: impl std::fmt::Display) -> Error {
    Error::Encode { kind: "mcap", detail: error.to_string() }
}

impl<W: Write + Seek> McapWriter<W> {
    /// Begins the file.
    ///
    /// # Errors
    /// [`Error::Encode`] with the writer's reason.
    pub fn new(out: W) -> Result<Self, Error> {
        let writer = WriteOptions::new()
            .profile("timberline")
            .library("timberline")
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            .compression_threads(0)
            .chunk_size(None)
            .create(out)
            .map_err(encode_error)?;
        Ok(Self { writer, sequence: 0 })
    }

    /// Adds a channel of messages of one Foxglove schema.
    ///
    /// # Errors
    /// [`Error::Encode`] with the writer's reason.
    pub fn channel<T: foxglove::Encode>(&mut self, topic: &str) -> Result<u16, Error> {
        let schema = T::get_schema().ok_or_else(|| encode_error("the message has no schema"))?;
        let id = self
            .writer
            .add_schema(&schema.name, &schema.encoding, &schema.data)
            .map_err(encode_error)?;
        self.writer.add_channel(id, topic, "protobuf", &BTreeMap::new()).map_err(encode_error)
    }

    /// Adds a message as a chunk of its own. Messages are numbered from 0 over all channels; their
    /// log time is that number in nanoseconds, which keeps their order and knows no clock.
    ///
    /// # Errors
    /// [`Error::Encode`] with the writer's reason.
    pub fn message<T: foxglove::Encode>(&mut self, channel: u16, value: &T) -> Result<(), Error> {
        let mut bytes = Vec::with_capacity(value.encoded_len().unwrap_or(0));
        value.encode(&mut bytes).map_err(|error| encode_error(format!("{error:?}")))?;
        let time = u64::from(self.sequence);
        let header = MessageHeader {
            channel_id: channel,
            sequence: self.sequence,
            log_time: time,
            publish_time: time,
        };
        self.writer.write_to_known_channel(&header, &bytes).map_err(encode_error)?;
        self.writer.flush().map_err(encode_error)?;
        self.sequence += 1;
        Ok(())
    }

    /// Ends the file with further metadata records and the header.
    ///
    /// # Errors
    /// [`Error::Encode`] with the writer's reason.
    pub fn finish(mut self, header: &Header, records: &[(&str, String)]) -> Result<W, Error> {
        let json = String::from_utf8(header.to_json()?).map_err(encode_error)?;
        let header_record = [(HEADER_RECORD, json)];
        for (name, json) in records.iter().chain(&header_record) {
            let metadata = BTreeMap::from([("json".to_owned(), json.clone())]);
            let record = mcap::records::Metadata { name: (*name).to_owned(), metadata };
            self.writer.write_metadata(&record).map_err(encode_error)?;
        }
        self.writer.finish().map_err(encode_error)?;
        Ok(self.writer.into_inner())
    }
}

/// A whole MCAP artefact in memory, all check sums verified but those of the chunks, which are
/// verified when a chunk is decoded (their compressed bytes are covered already).
pub struct McapReader {
    path: PathBuf,
    bytes: Vec<u8>,
    summary: Summary,
    header: Header,
}

impl McapReader {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`Error::Foreign`] for another MCAP or another file, [`Error::Corrupt`], [`Error::Io`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(Error::io(path, "read"))?;
        Self::from_bytes(path, bytes)
    }

    /// As [`McapReader::open`], of bytes already read.
    ///
    /// # Errors
    /// As [`McapReader::open`], except for [`Error::Io`].
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, Error> {
        check_sums(path, &bytes)?;
        let summary = Summary::read(&bytes)
            .map_err(|error| Error::corrupt(path, "summary", error.to_string()))?
            .ok_or_else(|| Error::corrupt(path, "summary", "there is none"))?;
        let json = metadata(path, &bytes, &summary, HEADER_RECORD)?;
        let header = serde_json::from_str(&json)
            .map_err(|error| Error::corrupt(path, "header", error.to_string()))?;
        Ok(Self { path: path.to_path_buf(), bytes, summary, header })
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

    /// Number of messages.
    #[must_use]
    pub fn message_count(&self) -> usize {
        self.summary.chunk_indexes.len()
    }

    /// The JSON of a metadata record.
    ///
    /// # Errors
    /// [`Error::Foreign`] when there is none of that name.
    pub fn record(&self, name: &str) -> Result<String, Error> {
        metadata(&self.path, &self.bytes, &self.summary, name)
    }

    /// The message with the given number, decoded.
    ///
    /// # Errors
    /// [`Error::Corrupt`] naming the chunk.
    pub fn message<T: foxglove::Decode>(&self, number: usize) -> Result<T, Error> {
        let place = format!("chunk {number}");
        let corrupt = |detail: String| Error::corrupt(&self.path, &place, detail);
        let index = self
            .summary
            .chunk_indexes
            .get(number)
            .ok_or_else(|| corrupt("there is no such chunk".to_owned()))?;
        let mut messages = self
            .summary
            .stream_chunk(&self.bytes, index)
            .map_err(|error| corrupt(error.to_string()))?;
        let message = messages
            .next()
            .ok_or_else(|| corrupt("it is empty".to_owned()))?
            .map_err(|error| corrupt(error.to_string()))?;
        T::decode(message.data.as_ref()).map_err(|error| corrupt(error.to_string()))
    }
}

fn metadata(path: &Path, bytes: &[u8], summary: &Summary, name: &str) -> Result<String, Error> {
    let missing = || Error::Foreign {
        path: path.to_path_buf(),
        found: format!("an MCAP file without the record `{name}`"),
    };
    let index = summary.metadata_indexes.iter().find(|i| i.name == name).ok_or_else(missing)?;
    let mut record = mcap::read::metadata(bytes, index)
        .map_err(|error| Error::corrupt(path, name, error.to_string()))?;
    record.metadata.remove("json").ok_or_else(missing)
}

/// Demands every check sum of the file: data section, summary section, lengths and magics.
fn check_sums(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let len = bytes.len();
    if len < 8 || bytes[..8] != MAGIC {
        let found = format!("{:?}", String::from_utf8_lossy(&bytes[..len.min(8)]));
        return Err(Error::Foreign { path: path.to_path_buf(), found });
    }
    if len < 8 + FOOTER_LEN + 8 || bytes[len - 8..] != MAGIC {
        return Err(Error::corrupt(path, "end", format!("cut off or changed after {len} bytes")));
    }
    let data_end = find_data_end(path, bytes)?;
    let summary_start = data_end + RECORD_PREFIX + 4;
    expect_crc(path, "data section", &bytes[..data_end], number32(bytes, summary_start - 4))?;
    let footer = len - 8 - FOOTER_LEN;
    let told = number64(bytes, footer + RECORD_PREFIX);
    if told != summary_start as u64 || number64(bytes, footer + 1) != 20 {
        let detail = format!("summary at byte {told}, expected {summary_start}");
        return Err(Error::corrupt(path, "footer", detail));
    }
    let summed = &bytes[summary_start..footer + FOOTER_LEN - 4];
    expect_crc(path, "summary section", summed, number32(bytes, footer + FOOTER_LEN - 4))
}

/// Byte offset of the record that ends the data section.
fn find_data_end(path: &Path, bytes: &[u8]) -> Result<usize, Error> {
    let mut at = 8;
    while at + RECORD_PREFIX <= bytes.len() {
        let len = number64(bytes, at + 1);
        if bytes[at] == OP_DATA_END
            && len == 4
            && at + RECORD_PREFIX + 4 + FOOTER_LEN <= bytes.len()
        {
            return Ok(at);
        }
        let next = usize::try_from(len).ok().and_then(|len| at.checked_add(RECORD_PREFIX + len));
        match next {
            Some(next) if bytes[at] != OP_DATA_END => at = next,
            _ => break,
        }
    }
    Err(Error::corrupt(path, "data section", format!("its records break off near byte {at}")))
}

fn expect_crc(path: &Path, place: &str, bytes: &[u8], expected: u32) -> Result<(), Error> {
    let found = crc32fast::hash(bytes);
    if found == expected {
        return Ok(());
    }
    Err(Error::corrupt(path, place, format!("checksum {found:08x}, expected {expected:08x}")))
}

fn number32(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}

fn number64(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]))
}
