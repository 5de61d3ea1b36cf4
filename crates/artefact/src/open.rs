//! Opening an artefact without knowing what it is.

use crate::container::{self, ContainerReader};
use crate::mcap_file::{self, McapReader};
use crate::{Error, Header, Kind};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// An open artefact of either file format.
pub enum Opened {
    /// A table or model.
    Container(Box<ContainerReader>),
    /// Something to look at.
    Mcap(Box<McapReader>),
}

impl Opened {
    /// Opens a file by its first bytes.
    ///
    /// # Errors
    /// [`Error::Foreign`], [`Error::Corrupt`], [`Error::Version`] or [`Error::Io`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut magic = Vec::new();
        let file = File::open(path).map_err(Error::io(path, "open"))?;
        file.take(8).read_to_end(&mut magic).map_err(Error::io(path, "read"))?;
        if magic == mcap_file::MAGIC {
            McapReader::open(path).map(|reader| Self::Mcap(Box::new(reader)))
        } else if magic == container::MAGIC {
            ContainerReader::open(path).map(|reader| Self::Container(Box::new(reader)))
        } else {
            let found = format!("it begins with {:?}", String::from_utf8_lossy(&magic));
            Err(Error::Foreign { path: path.to_path_buf(), found })
        }
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> &Header {
        match self {
            Self::Container(reader) => reader.header(),
            Self::Mcap(reader) => reader.header(),
        }
    }

    /// The header, when nothing else is wanted any more.
    #[must_use]
    pub fn into_header(self) -> Header {
        match self {
            Self::Container(reader) => reader.into_header(),
            Self::Mcap(reader) => reader.into_header(),
        }
    }

    /// The MCAP file, where points must be in one.
    ///
    /// # Errors
    /// [`Error::Corrupt`].
    pub fn mcap(&self, path: &Path) -> Result<&McapReader, Error> {
        match self {
            Self::Mcap(reader) => Ok(reader),
            Self::Container(_) => {
                Err(Error::corrupt(path, "payload", "points outside an MCAP file"))
            }
        }
    }

    /// Checks every byte of the file (an MCAP was checked when it was opened).
    ///
    /// # Errors
    /// [`Error::Corrupt`].
    pub fn verify(&mut self) -> Result<(), Error> {
        match self {
            Self::Container(reader) => reader.verify_payload(),
            Self::Mcap(_) => Ok(()),
        }
    }
}

/// The header of an artefact, checked; the payload of a table is not read.
///
/// # Errors
/// As [`Opened::open`].
pub fn read_header(path: &Path) -> Result<Header, Error> {
    Opened::open(path).map(Opened::into_header)
}

/// Reads an artefact of a known kind, checking all of it.
///
/// # Errors
/// As [`Opened::open`], and [`Error::WrongKind`].
pub fn read<K: Kind>(path: &Path) -> Result<(Header, K), Error> {
    let mut opened = Opened::open(path)?;
    check_kind::<K>(path, opened.header())?;
    let value = K::decode(path, &mut opened)?;
    Ok((opened.into_header(), value))
}

/// Checks that a header announces a kind in a version this program reads.
///
/// # Errors
/// [`Error::WrongKind`] or [`Error::Version`].
pub fn check_kind<K: Kind>(path: &Path, header: &Header) -> Result<(), Error> {
    if header.kind != K::NAME {
        return Err(Error::WrongKind {
            path: path.to_path_buf(),
            expected: K::NAME.to_owned(),
            found: header.kind.clone(),
        });
    }
    if !K::READABLE.contains(&header.kind_version) {
        return Err(Error::Version {
            path: path.to_path_buf(),
            what: K::NAME.to_owned(),
            found: header.kind_version,
            supported: K::READABLE,
        });
    }
    Ok(())
}
