//! Files that are not text tables, with their kind in the message.

use super::parquet::MAGIC;

/// Kind of a file by its first bytes, and the remedy; `None` if it may be a table.
pub(super) fn of(start: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = String::from_utf8_lossy(&start[..start.len().min(LOOKED_AT)]);
    let has = |word: &[u8]| start.windows(word.len()).any(|window| window == word);
    let known: [(bool, &str, &str); 17] = [
        (start.starts_with(b"PK\x03\x04") && has(b"xl/"), "an Excel workbook", "save the sheet as CSV"),
        (start.starts_with(b"PK\x03\x04"), "a ZIP archive", "unpack it, and give the table in it"),
        (start.starts_with(b"\xD0\xCF\x11\xE0"), "a workbook of old Excel", "save the sheet as CSV"),
        (start.starts_with(&MAGIC), "a Parquet file", "give its path, or write it as CSV"),
        (start.starts_with(b"ARROW1") || start.starts_with(b"FEA1"), "a Feather (Arrow) file", "write it as CSV"),
        (start.starts_with(b"MATLAB "), "a MATLAB file", "write its table as CSV (writetable)"),
        (start.starts_with(b"\x89HDF"), "an HDF5 file, or one of MATLAB 7.3", "write its table as CSV"),
        (start.starts_with(b"\x93NUMPY"), "a file of NumPy", "write the array as CSV (numpy.savetxt)"),
        (start.starts_with(b"\x80\x04") || start.starts_with(b"\x80\x05"), "a Python pickle", "write the table as CSV"),
        (start.starts_with(b"SQLite format 3"), "an SQLite database", "write the table as CSV"),
        (start.starts_with(b"#ROSBAG"), "a ROS bag", "write its topics as one CSV table"),
        (start.starts_with(b"\x1F\x8B"), "compressed by gzip", "unpack it, or give the path of its file"),
        (start.starts_with(b"\x28\xB5\x2F\xFD"), "compressed by zstd", "unpack it"),
        (
            start.starts_with(b"BZh") || start.starts_with(b"\xFD7zXZ") || start.starts_with(b"7z\xBC\xAF"),
            "compressed",
            "unpack it",
        ),
        (start.starts_with(b"%PDF"), "a PDF document", "get the table as CSV"),
        (
            is_xml(&text) && (text.contains("<fcd-export") || text.contains("<timestep")),
            "floating car data of SUMO as XML",
            "let SUMO write a table (--fcd-output fcd.csv), or turn it into one (xml2csv.py), and read that by the column map sumo-fcd",
        ),
        (is_xml(&text), "XML", "write its table as CSV"),
    ];
    let found = known.into_iter().find(|(is, ..)| *is).map(|(_, what, advice)| (what, advice));
    found.or_else(|| is_json(&text).then_some(("JSON", "write its records as rows of a CSV table")))
}

/// Length of the examined part of a file \[bytes\].
const LOOKED_AT: usize = 4096;

fn is_xml(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    text.starts_with("<?xml") || (text.starts_with('<') && text.contains('>'))
}

/// A JSON object or list; a header in brackets is not JSON.
fn is_json(text: &str) -> bool {
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let inside = |bracket| text.strip_prefix(bracket).map(str::trim_start);
    inside('{').is_some_and(|rest| rest.starts_with(['"', '}']))
        || inside('[').is_some_and(|rest| rest.starts_with(['{', '[', '"']))
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn files_are_named_for_what_they_are() {
        let cases: [(&[u8], &str); 12] = [
            (b"PK\x03\x04\x14\0xl/workbook.xml", "an Excel workbook"),
            (b"PK\x03\x04\x14\0drive.csv", "a ZIP archive"),
            (b"PAR1\x15\x04", "a Parquet file"),
            (b"MATLAB 5.0 MAT-file", "a MATLAB file"),
            (b"[{\"timestamp\": [1, 2]}]", "JSON"),
            (b"\xEF\xBB\xBF { \"t\": 1 }", "JSON"),
            (b"<?xml version=\"1.0\"?>\n<fcd-export>\n<timestep time=\"0\">", "floating car data of SUMO as XML"),
            (b"<gpx></gpx>", "XML"),
            (b"\x1F\x8B\x08", "compressed by gzip"),
            (b"\x28\xB5\x2F\xFD", "compressed by zstd"),
            (b"\x89HDF\r\n", "an HDF5 file, or one of MATLAB 7.3"),
            (b"SQLite format 3\0", "an SQLite database"),
        ];
        for (start, expected) in cases {
            assert_eq!(of(start).map(|found| found.0), Some(expected));
        }
        for table in ["time_s,speed_mps\n0,1\n", "[s],[m]\n", "Date,1,2,2020", "", "{t},v\n", "% lap 2\n"] {
            assert_eq!(of(table.as_bytes()), None, "{table}");
        }
    }
}
