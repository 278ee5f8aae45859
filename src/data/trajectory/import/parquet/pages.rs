//! The pages of a Parquet file. The library allocates the size declared in the header of a page, so each header is checked before.

use crate::text::bounded::TABLE_MAX;
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, Length};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// End of a file, after its columns: the length of the metadata, and the magic number \[bytes\].
pub(super) const FOOTER: u64 = 8;

/// The largest page, unpacked \[bytes\]: a column of as many numbers as a table may have rows. Writers aim at 1 MB; some write a column as one page.
pub(super) const PAGE_MAX: i32 = 256 << 20;
/// The largest page with the values of a dictionary \[bytes\]; each of them takes several times as much in memory. Writers stop at 1 or 2 MB.
const DICTIONARY_MAX: i32 = 16 << 20;
/// The longest header \[bytes\]: it may hold the smallest and the largest text of a page.
const HEADER_MAX: u64 = 1 << 20;

/// A file whose pages are checked.
pub(super) struct Pages {
    file: File,
    /// Bytes of all pages so far, unpacked.
    unpacked: AtomicU64,
    dictionaries: Arc<Dictionaries>,
}

impl Pages {
    pub fn of(file: File, dictionaries: Arc<Dictionaries>) -> Pages {
        Pages { file, unpacked: AtomicU64::new(0), dictionaries }
    }
}

/// Which parts of columns have a dictionary: by their first byte, their end and whether a page with a dictionary has been met. The library takes it
/// for granted that pages which refer to one come behind it.
#[derive(Default)]
pub(super) struct Dictionaries(Mutex<BTreeMap<u64, (u64, bool)>>);

impl Dictionaries {
    /// Adds the part of a column from one byte to another.
    pub fn watch(&self, start: u64, end: u64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(start, (end, false));
    }

    fn check(&self, at: u64, header: &Header) -> std::result::Result<(), String> {
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((_, (_, met))) = parts.range_mut(..=at).next_back().filter(|(_, (end, _))| at < *end) else {
            return Ok(());
        };
        *met |= header.is_dictionary;
        if header.uses_dictionary && !*met {
            return Err("a page refers to a dictionary that its column does not have".to_owned());
        }
        Ok(())
    }
}

impl Length for Pages {
    fn len(&self) -> u64 {
        Length::len(&self.file)
    }
}

impl ChunkReader for Pages {
    type T = BufReader<File>;

    /// A part that begins with a header: a page, or the footer.
    fn get_read(&self, start: u64) -> Result<BufReader<File>> {
        let mut reader = self.file.get_read(start)?;
        if start.saturating_add(FOOTER) == self.len() {
            return Ok(reader);
        }
        let header = Header::read(&mut reader.by_ref().take(HEADER_MAX))?;
        header.check().and_then(|()| self.dictionaries.check(start, &header)).map_err(ParquetError::General)?;
        let page = header.unpacked.max(0).unsigned_abs().into();
        if self.unpacked.fetch_add(page, Ordering::Relaxed) + page > TABLE_MAX {
            return Err(ParquetError::General(format!("expected at most {TABLE_MAX} bytes, unpacked, found more")));
        }
        reader.seek(SeekFrom::Start(start))?;
        Ok(reader)
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<bytes::Bytes> {
        self.file.get_bytes(start, length)
    }
}

/// The fields of a page's header that decide its memory.
#[derive(Debug, Default, PartialEq)]
struct Header {
    /// Size \[bytes\].
    unpacked: i32,
    /// Values of a dictionary.
    values: i32,
    is_dictionary: bool,
    /// Values as places in a dictionary.
    uses_dictionary: bool,
}

// Types of Thrift's compact protocol.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const I16: u8 = 4;
const I32: u8 = 5;
const I64: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const STRUCT: u8 = 12;

// Fields of a `PageHeader`, as in parquet.thrift.
const UNPACKED: i16 = 2;
const DATA: i16 = 5;
const DICTIONARY: i16 = 7;
const DATA_V2: i16 = 8;

/// Statistics contain no nested structures.
const DEPTH: usize = 3;

impl Header {
    fn read(input: &mut impl Read) -> io::Result<Header> {
        let mut header = Header::default();
        header.fields(input, 0)?;
        Ok(header)
    }

    /// The fields of the header itself (`of` 0), or of one of its parts. Each must have the type that the format gives it, so that the
    /// library reads the same.
    fn fields(&mut self, input: &mut impl Read, of: i16) -> io::Result<()> {
        let mut before = 0;
        while let Some((field, kind)) = field(input, before)? {
            match (of, field, kind) {
                (0, ..=4, I32) | (DATA | DICTIONARY | DATA_V2, _, I32) => self.see(of, field, number(input)? as i32),
                (0, 5..=8, STRUCT) => {
                    self.is_dictionary |= field == DICTIONARY;
                    self.fields(input, field)?;
                }
                (DICTIONARY, 3, TRUE | FALSE) | (DATA_V2, 7, TRUE | FALSE) => {}
                (DATA, 5, STRUCT) | (DATA_V2, 8, STRUCT) => skip(input, STRUCT, DEPTH)?,
                _ => return Err(io::Error::other("the header of a page is invalid")),
            }
            before = field;
        }
        Ok(())
    }

    fn see(&mut self, of: i16, field: i16, value: i32) {
        match (of, field) {
            (0, UNPACKED) => self.unpacked = self.unpacked.max(value),
            (DICTIONARY, 1) => self.values = self.values.max(value),
            // PLAIN_DICTIONARY and RLE_DICTIONARY.
            (DATA, 2) | (DATA_V2, 4) => self.uses_dictionary |= [2, 8].contains(&value),
            _ => {}
        }
    }

    fn check(&self) -> std::result::Result<(), String> {
        let (what, most) = if self.is_dictionary { ("a dictionary", DICTIONARY_MAX) } else { ("a page", PAGE_MAX) };
        if self.unpacked > most {
            return Err(format!("{what} has {} bytes, unpacked, expected at most {most}", self.unpacked));
        }
        // Each takes a byte at least.
        if self.values > self.unpacked {
            return Err(format!("a dictionary of {} bytes has {} values", self.unpacked, self.values));
        }
        Ok(())
    }
}

/// Number and type of the next field of a struct; none at its end.
fn field(input: &mut impl Read, before: i16) -> io::Result<Option<(i16, u8)>> {
    let byte = byte(input)?;
    let number = match byte >> 4 {
        _ if byte == 0 => return Ok(None),
        0 => number(input)? as i16,
        step => before.wrapping_add(step.into()),
    };
    Ok(Some((number, byte & 15)))
}

fn skip(input: &mut impl Read, kind: u8, depth: usize) -> io::Result<()> {
    let length = match kind {
        TRUE | FALSE => 0,
        BYTE => 1,
        I16 | I32 | I64 => return number(input).map(drop),
        DOUBLE => 8,
        BINARY => varint(input)?,
        STRUCT if depth > 0 => {
            let mut before = 0;
            while let Some((number, kind)) = field(input, before)? {
                skip(input, kind, depth - 1)?;
                before = number;
            }
            0
        }
        _ => return Err(io::Error::other("the statistics of a page are invalid")),
    };
    match io::copy(&mut input.take(length), &mut io::sink())? {
        found if found == length => Ok(()),
        _ => Err(io::ErrorKind::UnexpectedEof.into()),
    }
}

fn byte(input: &mut impl Read) -> io::Result<u8> {
    let mut byte = [0];
    input.read_exact(&mut byte)?;
    Ok(byte[0])
}

/// Seven bits a byte, the lowest first.
pub(super) fn varint(input: &mut impl Read) -> io::Result<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = byte(input)?;
        value |= u64::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Err(io::Error::other("a number in the header of a page is unterminated"))
}

/// Zigzag encoding: 0, -1, 1, -2, ...
fn number(input: &mut impl Read) -> io::Result<i64> {
    let place = varint(input)?;
    Ok((place >> 1) as i64 ^ -((place & 1) as i64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(mut bytes: &[u8]) -> io::Result<Header> {
        Header::read(&mut bytes)
    }

    #[test]
    fn headers_say_what_pages_take() {
        // type 0, 150 bytes unpacked, 30 packed; 3 values, PLAIN, levels RLE, statistics with a text.
        let page = [
            0x15, 0, 0x15, 0xAC, 2, 0x15, 60, 0x2C, 0x15, 6, 0x15, 0, 0x15, 6, 0x15, 6, 0x1C, 0x18, 2, b'a', b'b', 0,
            0, 0,
        ];
        let expected = Header { unpacked: 150, ..Header::default() };
        assert_eq!(read(&page).expect("a header"), expected);
        assert!(expected.check().is_ok());
        // A truncated file is invalid, wherever it ends.
        assert!((0..page.len()).all(|end| read(&page[..end]).is_err()));
        // The last of several sizes would count.
        let twice = [0x15, 0, 0x15, 2, 0x05, 4, 0xFE, 0xFF, 0xFF, 0xFF, 0x0F, 0];
        let said = read(&twice).expect("a header").check().expect_err("too much");
        assert_eq!(said, format!("a page has {} bytes, unpacked, expected at most {PAGE_MAX}", i32::MAX));
        // A dictionary of 2 bytes with 64 values; a size in one byte; an unterminated text.
        let check = |bytes: &[u8]| read(bytes).map(|header| header.check());
        assert!(check(&[0x15, 4, 0x15, 4, 0x5C, 0x15, 0x80, 1, 0x15, 0, 0, 0]).expect("a header").is_err());
        assert!(read(&[0x15, 0, 0x13, 4, 0]).is_err());
        assert!(read(&[0x5C, 0x5C, 0x18, 0xFF, 0xFF, 0xFF, 0x7F, 0, 0, 0]).is_err());
    }
}
