//! Limits of files: a device, or a file of another kind, must not fill the memory.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The longest text that users write: maps, plans, bounds, vehicles, curves, extensions \[bytes\].
pub const TEXT_MAX: u64 = 16 << 20;
/// The longest text that this program writes and reads again: results, diagnoses, parts of a study \[bytes\]. A thousand replicates with their convergence
/// are some megabytes.
pub const RESULT_MAX: u64 = 64 << 20;
/// The longest line of a table \[bytes\]; 60 columns of 20 digits need about 1 200.
pub const LINE_MAX: usize = 1 << 20;

/// Largest table of measurements, as CSV or Parquet \[bytes\]: of text, unpacked if it is packed, and of memory for its rows. That
/// of NGSIM, the largest in common use, has 1.5 GB of text, and its 12 million rows take 2.3 GB.
pub const TABLE_MAX: u64 = 3 << 30;
/// Memory of a row beside the 8 bytes of each column \[bytes\]: its line, checksum, and place among times and names.
pub const ROW: u64 = 128;
/// Memory of a drive that is read, checked and calibrated, as a multiple of that of the rows of its table: 4.9 for a pair of 500 000 rows, and
/// the program itself has a seventh of 1 GB.
const WHOLE: u64 = 8;
/// The largest table that this program writes and reads again \[bytes\]: of text, and [`ROW`] for each line. A fleet of 100 000 pairs with three laws
/// has 130 MB.
pub const OWN_TABLE_MAX: u64 = 256 << 20;

/// Limit of the address space of this process \[bytes\] (`ulimit -v`). Other systems than Linux set no such limit, or report it elsewhere.
pub fn address_space() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Memory that the rows of a table of measurements may take \[bytes\].
pub fn table_memory() -> u64 {
    address_space().map_or(TABLE_MAX, |limit| TABLE_MAX.min(limit / WHOLE))
}

/// The bytes of a file. Fails when it cannot be read, or has more than `most` bytes ([`io::ErrorKind::FileTooLarge`]).
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let message = format!("expected at most {most} bytes, found more; is this the right file?");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// The text of a file. Fails as [`read`], and when it is not UTF-8.
pub fn read_to_string(path: &Path, most: u64) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "expected text in UTF-8; is this the right file?");
    String::from_utf8(read(path, most)?).map_err(no_text)
}

/// Passes its input on until a line is longer than [`LINE_MAX`], or the input exceeds the limit.
pub struct Lines<R> {
    inner: R,
    /// Bytes of the line so far.
    length: usize,
    /// Remaining allowance \[bytes\], each line counted as [`ROW`] more.
    left: u64,
}

impl<R: Read> Lines<R> {
    /// Limits the lines of `inner`, in any number.
    pub fn new(inner: R) -> Self {
        Lines { inner, length: 0, left: u64::MAX }
    }
}

impl Lines<File> {
    /// A table of this program, of at most [`OWN_TABLE_MAX`]. Fails when it cannot be opened.
    pub fn of_table(path: &Path) -> io::Result<Self> {
        Ok(Lines { inner: File::open(path)?, length: 0, left: OWN_TABLE_MAX })
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        match buffer[..read].iter().rposition(|&byte| byte == b'\n') {
            Some(end) => self.length = read - end - 1,
            None => self.length += read,
        }
        if self.length > LINE_MAX {
            return Err(io::Error::other(format!(
                "expected lines of at most {LINE_MAX} bytes, found a longer one; is this the right file?"
            )));
        }
        let lines = buffer[..read].iter().filter(|&&byte| byte == b'\n').count() as u64;
        self.left = self.left.checked_sub(read as u64 + ROW * lines).ok_or_else(|| {
            let message =
                format!("expected a table of at most {OWN_TABLE_MAX} bytes, found more; is this the right file?");
            io::Error::new(io::ErrorKind::FileTooLarge, message)
        })?;
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_end_is_refused() {
        let mut endless = Lines::new(io::repeat(b'1'));
        let error = io::copy(&mut endless, &mut io::sink()).expect_err("it never ends");
        assert!(error.to_string().starts_with("expected lines of at most 1048576 bytes"), "{error}");
        let rows = "1,2,3\n".repeat(400_000);
        assert_eq!(
            io::copy(&mut Lines::new(rows.as_bytes()), &mut io::sink()).expect("short lines"),
            rows.len() as u64
        );
    }

    #[test]
    fn a_table_of_too_many_lines_is_refused() {
        let lines = "1\n".repeat(10);
        let table = |left| Lines { inner: lines.as_bytes(), length: 0, left };
        assert!(io::copy(&mut table(10 * (ROW + 2)), &mut io::sink()).is_ok());
        let error = io::copy(&mut table(10 * (ROW + 2) - 1), &mut io::sink()).expect_err("one too many");
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_end_is_refused() {
        let error = read_to_string(Path::new("/dev/zero"), 1000).expect_err("it never ends");
        assert!(error.to_string().starts_with("expected at most 1000 bytes"), "{error}");
    }
}
