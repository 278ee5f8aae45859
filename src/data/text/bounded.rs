//! Files are read to a limit: a device, or a file of another kind, must not fill the memory.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The longest text that people write: maps, plans, bounds, vehicles, curves, extensions \[bytes\].
pub const TEXT_MAX: u64 = 16 << 20;
/// The longest text that this program writes and reads again: results, diagnoses, parts of a study \[bytes\]. A thousand replicates with their convergence
/// are some megabytes.
pub const RESULT_MAX: u64 = 64 << 20;
/// The longest line of a table \[bytes\]; 60 columns of 20 digits need about 1 200.
pub const LINE_MAX: usize = 1 << 20;

/// The bytes of a file.
///
/// # Errors
/// When it cannot be read, or has more than `most` bytes ([`io::ErrorKind::FileTooLarge`]).
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let message = format!("expected at most {most} bytes, found more; is this the right file?");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// The text of a file.
///
/// # Errors
/// As [`read`], and when it is not UTF-8.
pub fn read_to_string(path: &Path, most: u64) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "expected text in UTF-8; is this the right file?");
    String::from_utf8(read(path, most)?).map_err(no_text)
}

/// Hands on what it reads until a line is longer than [`LINE_MAX`].
pub struct Lines<R> {
    inner: R,
    /// Bytes of the line so far.
    length: usize,
}

impl<R: Read> Lines<R> {
    /// Watches the lines of `inner`.
    pub fn new(inner: R) -> Self {
        Lines { inner, length: 0 }
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

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_end_is_refused() {
        let error = read_to_string(Path::new("/dev/zero"), 1000).expect_err("it never ends");
        assert!(error.to_string().starts_with("expected at most 1000 bytes"), "{error}");
    }
}
