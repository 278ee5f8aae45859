//! Lines of a text file in bounded memory, with the checksum of everything read.

use super::kind;
use super::problems::{Problems, Stop};
use crate::text::bounded::{LINE_MAX, ROW, TABLE_MAX, table_memory};
use crate::trajectory::error::ProblemKind;
use crate::trajectory::hexadecimal;
use sha2::{Digest, Sha256};
use std::io::{BufRead, BufReader, Read};

/// A text file, line by line.
pub(in crate::trajectory) struct Lines<R> {
    input: BufReader<R>,
    hash: Sha256,
    buffer: Vec<u8>,
    number: u64,
    /// Bytes of text so far.
    text: u64,
    /// Memory of each line \[bytes\].
    row: u64,
    /// Largest size of all lines as text \[bytes\].
    most: u64,
    /// Largest memory of all lines \[bytes\].
    most_memory: u64,
    /// True if the next call returns the line in the buffer again.
    back: bool,
    /// False if the end of the file ended the last line.
    pub terminated: bool,
}

impl<R: Read> Lines<R> {
    pub fn new(input: R) -> Self {
        Lines {
            input: BufReader::with_capacity(1 << 16, input),
            hash: Sha256::new(),
            buffer: Vec::new(),
            number: 0,
            text: 0,
            row: ROW,
            most: TABLE_MAX,
            most_memory: table_memory(),
            back: false,
            terminated: true,
        }
    }

    /// From this line on, each line keeps this many columns.
    pub fn keep(&mut self, columns: usize) {
        self.row = ROW + 8 * columns as u64;
    }

    /// Number of the line read last, counted from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The next line without its end (LF or CRLF) and without a byte order mark, or `None` at the end.
    pub fn next(&mut self, problems: &mut Problems) -> Result<Option<&str>, Stop> {
        if std::mem::take(&mut self.back) {
            self.number += 1;
            return self.text(problems).map(Some);
        }
        self.buffer.clear();
        self.terminated = false;
        while !self.terminated {
            let bytes = match self.input.fill_buf() {
                Ok(bytes) => bytes,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(Stop::Io(self.number + 1, error)),
            };
            if bytes.is_empty() {
                break;
            }
            let end = bytes.iter().position(|&byte| byte == b'\n');
            let used = end.map_or(bytes.len(), |end| end + 1);
            self.terminated = end.is_some();
            self.buffer.extend_from_slice(&bytes[..used]);
            self.hash.update(&bytes[..used]);
            self.input.consume(used);
            self.text += used as u64;
            if self.buffer.len() > LINE_MAX {
                let kind = ProblemKind::LineTooLong { limit: LINE_MAX };
                return Err(problems.stop(self.number + 1, None, kind));
            }
            let kind = if self.text > self.most {
                Some(ProblemKind::TableTooLarge { limit: self.most })
            } else if (self.number + 1) * self.row > self.most_memory {
                Some(ProblemKind::TooManyRows { limit: self.most_memory, rows: self.number })
            } else {
                None
            };
            if let Some(kind) = kind {
                return Err(problems.stop(self.number + 1, None, kind));
            }
        }
        if self.buffer.is_empty() {
            return Ok(None);
        }
        self.number += 1;
        self.text(problems).map(Some)
    }

    /// The next call returns the last line once more.
    pub fn unread(&mut self) {
        self.back = true;
        self.number -= 1;
    }

    fn text(&self, problems: &mut Problems) -> Result<&str, Stop> {
        let mut bytes = self.buffer.as_slice();
        if self.number == 1 {
            if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
                return Err(problems.stop(1, Some(1), ProblemKind::Utf16));
            }
            let start = [bytes, self.input.buffer()].concat();
            if let Some((what, advice)) = kind::of(&start) {
                return Err(problems.stop(1, Some(1), ProblemKind::OtherFormat { what, advice }));
            }
            bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        }
        if self.terminated {
            bytes = bytes.strip_suffix(b"\n").unwrap_or(bytes);
        }
        bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        let (text, bad) = match std::str::from_utf8(bytes) {
            Ok(text) => (text, None),
            Err(error) => {
                let valid = error.valid_up_to();
                // The part before the first bad byte is valid UTF-8 by definition of `valid_up_to`.
                let text = std::str::from_utf8(&bytes[..valid]).unwrap_or_default();
                (text, Some(bytes[valid]))
            }
        };
        let control = text.bytes().position(|b| b < 0x20 && b != b'\t');
        let (place, byte) = match (control, bad) {
            (Some(place), _) => (place, text.as_bytes()[place]),
            (None, Some(byte)) => (text.len(), byte),
            (None, None) => return Ok(text),
        };
        let kind = match byte {
            b'\r' => ProblemKind::LoneCarriageReturn,
            byte => ProblemKind::NotText { byte },
        };
        let column = text[..place].chars().count() + 1;
        Err(problems.stop(self.number, Some(column), kind))
    }

    /// SHA-256 of the bytes read, lower-case hexadecimal; of the whole file once `next` has returned `None`.
    pub fn sha256(self) -> String {
        hexadecimal(&self.hash.finalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of lines to read of many short ones, or the line of the problem.
    fn read(most: u64, columns: usize) -> Result<u64, String> {
        let text = "1,2,3\n".repeat(1000);
        let mut lines = Lines { most_memory: most, ..Lines::new(text.as_bytes()) };
        lines.keep(columns);
        let mut problems = Problems::default();
        loop {
            match lines.next(&mut problems) {
                Ok(Some(_)) => {}
                Ok(None) => return Ok(lines.number()),
                stop => return Err(problems.finish("table.csv", stop.map(drop)).expect_err("stopped").to_string()),
            }
        }
    }

    #[test]
    fn a_table_is_bounded_in_text_and_in_memory() {
        let row = ROW + 8 * 3;
        assert_eq!(read(1000 * row, 3), Ok(1000));
        let said = read(500 * row, 3).expect_err("too many rows");
        assert!(said.starts_with("table.csv:501: expected at most 500 lines, "), "{said}");
        // A file has fewer wide rows, and long lines count by their text.
        assert!(read(500 * row, 20).expect_err("too many numbers").starts_with("table.csv:264:"));
        let long = format!("{}\n", "1".repeat(1000)).repeat(10);
        let mut lines = Lines { most: 5000, ..Lines::new(long.as_bytes()) };
        let mut problems = Problems::default();
        let taken = std::iter::from_fn(|| lines.next(&mut problems).is_ok().then_some(())).count();
        assert_eq!(taken, 4);
    }
}
