//! Tables that would take far more memory or time than their files suggest, and columns that no reader can convert to text: each is refused
//! at once, or read as if the column were absent.

use crate::common::parquet_table::{ROWS, table, with_drivers};
use cpu_time::ThreadTime;
use leadlag::internal::trajectory::import;
use parquet::basic::{Compression, Encoding};
use parquet::data_type::{ByteArray, ByteArrayType, FixedLenByteArray, FixedLenByteArrayType, Int32Type};
use parquet::file::metadata::ParquetMetaDataWriter;
use parquet::file::properties::{WriterProperties, WriterVersion};
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::io::Write;

/// Time limit for each file here \[s of CPU\]; each takes milliseconds, except the last one, which takes some seconds.
const LONGEST_S: u64 = 30;

fn plain() -> WriterProperties {
    WriterProperties::builder().build()
}

/// The rows of a file, or its error with all causes.
fn read(name: &str, file: &[u8]) -> Result<usize, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, file).expect("room");
    let began = ThreadTime::now();
    let read = import::read(&path, None);
    let took = began.elapsed();
    assert!(took.as_secs() < LONGEST_S, "{name} took {took:?}");
    read.map(|recording| recording.platoons[0].t.len()).map_err(|error| {
        let mut said = error.to_string();
        let mut cause = std::error::Error::source(&error);
        while let Some(next) = cause {
            said += &format!(": {next}");
            cause = next.source();
        }
        said
    })
}

#[track_caller]
fn is_refused(name: &str, file: &[u8], expected: &str) {
    let said = read(name, file).expect_err("it is no table that can be read");
    assert!(said.contains(expected), "expected {expected:?} in {said}");
}

#[test]
fn a_date_beyond_all_calendars_is_a_number() {
    for day in [i32::MAX, i32::MIN, 18_000] {
        let file = table::<Int32Type>("int32 day (DATE)", day, plain());
        assert_eq!(read("dates.parquet", &file), Ok(ROWS), "{day}");
    }
}

#[test]
fn spans_of_time_are_refused_by_the_name_of_their_column() {
    let value = FixedLenByteArray::from(vec![1; 12]);
    let file = table::<FixedLenByteArrayType>("fixed_len_byte_array(12) lag (INTERVAL)", value, plain());
    is_refused("spans.parquet", &file, "column lag holds time intervals (INTERVAL)");
}

#[test]
fn decimal_numbers_have_an_end() {
    let value = ByteArray::from(vec![0x7F; 20]);
    let file = table::<ByteArrayType>("binary x (DECIMAL(100000, 100000))", value.clone(), plain());
    is_refused("digits.parquet", &file, "column x holds decimal numbers of 100000 digits, expected at most 76");
    let file = table::<ByteArrayType>("binary x (DECIMAL(60, 3))", value, plain());
    assert_eq!(read("decimals.parquet", &file), Ok(ROWS));
    let file = table::<ByteArrayType>("binary x (DECIMAL(60, 3))", ByteArray::from(vec![0x7F; 100_000]), plain());
    is_refused("long.parquet", &file, "column x: expected values of at most 38 bytes, found one of 100000");
}

#[test]
fn rows_that_a_few_bytes_promise_are_not_waited_for() {
    let file = table::<Int32Type>("int32 n", 1, plain());
    let mut written = tempfile::tempfile().expect("a file");
    written.write_all(&file).expect("room");
    let metadata = SerializedFileReader::new(written).expect("a table").metadata().clone();
    let groups = metadata
        .row_groups()
        .iter()
        .map(|group| group.clone().into_builder().set_num_rows(1 << 31).build().expect("a group"));
    let metadata = metadata.clone().into_builder().set_row_groups(groups.collect()).build();
    let length = u32::from_le_bytes(file[file.len() - 8..][..4].try_into().expect("4 bytes")) as usize;
    let mut forged = file[..file.len() - 8 - length].to_vec();
    ParquetMetaDataWriter::new(&mut forged, &metadata).finish().expect("memory");
    is_refused("rows.parquet", &forged, "it has 2147483648 rows, expected at most 25165824");
}

/// The size of the first page is the second number of its header, behind four bytes of the file and two of its type.
#[test]
fn a_page_is_not_believed_what_it_claims() {
    for how in [Compression::SNAPPY, Compression::ZSTD(Default::default()), Compression::UNCOMPRESSED] {
        for dictionary in [true, false] {
            let properties =
                WriterProperties::builder().set_compression(how).set_dictionary_enabled(dictionary).build();
            let mut file = table::<Int32Type>("int32 n", 1, properties);
            assert_eq!(read("sound.parquet", &file), Ok(ROWS), "{how}");
            assert!(file[4] == 0x15 && file[6] == 0x15, "a page header");
            let end = (7..).find(|&at| file[at] < 128).expect("a number ends");
            // 2^31 - 2, zigzag.
            file.splice(7..=end, [0xFC, 0xFF, 0xFF, 0xFF, 0x0F]);
            let expected = if dictionary { "a dictionary has 2147483646 bytes" } else { "a page has 2147483646 bytes" };
            is_refused("page.parquet", &file, expected);
        }
    }
}

/// Text as its difference from the previous value, as some writers store it: with missing values, over several pages and blocks, in both
/// versions of the format.
#[test]
fn text_by_its_changes_is_read() {
    let driver = |k: usize| format!("driver {k:03}{}", "x".repeat(k % 3));
    let drivers: Vec<Option<String>> = (0..1000).map(|row| (row % 7 != 3).then(|| driver(row / 50))).collect();
    let folder = tempfile::tempdir().expect("a folder");
    let notes = |encoding: Encoding, version: WriterVersion| {
        let path = folder.path().join("pairs.parquet");
        std::fs::write(&path, with_drivers(&drivers, encoding, version)).expect("room");
        let recording = import::read(&path, None).unwrap_or_else(|error| panic!("{encoding}: {error:?}"));
        format!("{:?}", recording.platoons[0].notes)
    };
    let expected = notes(Encoding::PLAIN, WriterVersion::PARQUET_1_0);
    assert!((0..20).all(|k| expected.contains(&driver(k))), "{expected}");
    for version in [WriterVersion::PARQUET_1_0, WriterVersion::PARQUET_2_0] {
        for encoding in [Encoding::DELTA_BYTE_ARRAY, Encoding::DELTA_LENGTH_BYTE_ARRAY] {
            assert_eq!(notes(encoding, version), expected, "{encoding} {version:?}");
        }
    }
}

#[test]
fn bytes_of_fixed_length_by_their_changes_are_refused() {
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_column_encoding("car".into(), Encoding::DELTA_BYTE_ARRAY)
        .build();
    let value = FixedLenByteArray::from(vec![65; 4]);
    let file = table::<FixedLenByteArrayType>("fixed_len_byte_array(4) car", value, properties);
    is_refused(
        "fixed.parquet",
        &file,
        "column \"car\": it has the encoding DELTA_BYTE_ARRAY, which leadlag reads of text only",
    );
}

/// The library meets it with a panic, whose message reaches the user.
#[test]
fn a_page_without_the_dictionary_that_it_refers_to_is_refused() {
    let properties = WriterProperties::builder().set_dictionary_enabled(false).build();
    let mut file = table::<Int32Type>("int32 n", 1, properties);
    // Of the first page: PLAIN, and RLE for both kinds of levels.
    let plain = [0x15, 0, 0x15, 6, 0x15, 6];
    let at = file.windows(plain.len()).position(|bytes| bytes == plain).expect("a page of plain values");
    // RLE_DICTIONARY, zigzag.
    file[at + 1] = 0x10;
    is_refused("page.parquet", &file, "a page refers to a dictionary that its column does not have");
}

#[test]
fn lines_without_end_in_a_packed_table_are_not_waited_for() {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(b"time_s,lead_speed_mps,speed_mps,spacing_m\n").expect("memory");
    (0..26).for_each(|_| packed.write_all(&vec![b'\n'; 1 << 20]).expect("memory"));
    let file = packed.finish().expect("memory");
    assert!(file.len() < 200_000, "{} bytes", file.len());
    is_refused("lines.csv.gz", &file, "expected at most 20132659 lines, which take 3072 MiB of memory");
}
