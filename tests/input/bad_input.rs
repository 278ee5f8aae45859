//! Broken files, each with the exact message: file, line, column, expected, found, remedy.

use crate::common;
use leadlag::internal::trajectory::import::{self, ColumnMap, Labels, Layout, read_mapped_from};
use leadlag::internal::trajectory::{Grade, Note, Preparation, inspect, prepare};
use std::io::{Cursor, Read};

/// Reader of a file.
#[derive(Debug, Clone, Copy)]
enum Reader {
    /// The importers, which recognise the layout.
    Detect,
    As(Layout),
    Grade,
    Labels,
}

/// A small good file, and its reader.
type Base = (&'static str, Reader, &'static str);

const PAIR: Base =
    ("pair", Reader::Detect, "time_s,lead_speed_mps,speed_mps,spacing_m\n0,10,9,20\n0.1,10,9,20.1\n0.2,10,9,20.2\n");
const OPENACC: Base = (
    "openacc",
    Reader::Detect,
    "Date,1,2,2020\r\nVehicle_order,A,B\r\nNumber_of_vehicles,2\r\nACC,1\r\nDistance_setting,min\r\n\
     Time,Speed1,E1,N1,Speed2,E2,N2,IVS1,Driver2\r\n\
     1.0,10,0,0,9,-25,0,20,ACC\r\n1.1,10,0,0,9,-25,0,20.1,ACC\r\n1.2,10,0,0,9,-25,0,20.2,ACC\r\n",
);
const REBUILT: Base = (
    "rebuilt",
    Reader::Detect,
    "Date,1,2,2020\nVehicle_order,A,B\nNumber_of_vehicles,2\nACC,1\nDistance_setting,min\n\
     Time,Speed1,Speed2,IVS1\n1.0,10,9,20\n1.1,10,9,20.1\n1.2,10,9,20.2\n",
);
const PROCESSED: Base = (
    "processed",
    Reader::Detect,
    "Time,X1,X2,SpeedDoppler1,SpeedDoppler2,Accel1,Accel2,Spacing2\n\
     1.0,100,75,10,9,0,0,20\n1.1,101,76,10,9,0,0,20.1\n1.2,102,77,10,9,0,0,20.2\n",
);
const ULTRA: Base = (
    "ultra-av",
    Reader::Detect,
    "Trajectory_ID,Time_Index,Speed_LV,Speed_FAV,Spatial_Gap\n\
     0,0.1,10,9,20\n0,0.2,10,9,20.1\n0,0.3,10,9,20.2\n1,0.1,10,9,20.3\n",
);
const GRADE: Base = ("grade", Reader::Grade, "X,Y\n0,0\n2.5,0.01\n5,0.02\n");
const LABELS: Base = (
    "labels",
    Reader::Labels,
    "File,type1,type2,type3,type4,type5,length1,length2,length3,length4,length5\n\
     drive,1,2,3,4,5,5.196,4.706,4.957,4.957,4.464\n",
);

/// Message of the reader; empty if it accepts the file.
fn message(reader: Reader, input: impl Read) -> String {
    let result = match reader {
        Reader::Detect => import::read_from(input, "bad.csv", None).map(drop),
        Reader::As(layout) => import::read_from(input, "bad.csv", Some(layout)).map(drop),
        Reader::Grade => Grade::read_from(input, "bad.csv").map(drop),
        Reader::Labels => Labels::read_from(input, "bad.csv").map(drop),
    };
    result.err().map(|error| error.to_string()).unwrap_or_default()
}

/// The good file with its first `from` replaced by `to`.
fn broken(base: Base, from: &[u8], to: &[u8]) -> Vec<u8> {
    let good = base.2.as_bytes();
    let at = good.windows(from.len()).position(|window| window == from);
    let at = at.unwrap_or_else(|| panic!("{} has no {}", base.0, from.escape_ascii()));
    [&good[..at], to, &good[at + from.len()..]].concat()
}

/// Fault, file, replaced text, replacement, and message.
type Case = (&'static str, Base, &'static [u8], &'static [u8], &'static str);

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("wrong header", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"a,b,c,d", "bad.csv:1: no known layout has the columns a, b, c, d; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with --columns (`leadlag list columns`, or a file of your own)"),
    ("missing column", PAIR, b"spacing_m", b"gap", "bad.csv:1: column spacing_m is missing; the file has time_s, lead_speed_mps, speed_mps, gap (needed: time_s, speed_mps, spacing_m, lead_speed_mps); rename gap to spacing_m? Or read the table by a column map (`leadlag list columns`)"),
    ("text in a number", PAIR, b"0.1,10,9", b"0.1,far,9", "bad.csv:3:5: column lead_speed_mps: expected a finite number, found \"far\"; leave the field empty if the value is missing"),
    ("infinite", PAIR, b"0.1,10,9", b"0.1,10,inf", "bad.csv:3:8: column speed_mps: expected a finite number, found \"inf\"; leave the field empty if the value is missing"),
    ("time going back", PAIR, b"0.2,10", b"0.05,10", "bad.csv:4:1: time_s: expected a time after 0.1, found 0.05; time runs backwards: sort the rows, or split the file here"),
    ("duplicate time", PAIR, b"0.2,10", b"0.1,10", "bad.csv:4:1: time_s: expected a time after 0.1, found 0.1 again, first in line 3; the two rows differ: remove one of them"),
    ("missing time", PAIR, b"0.1,10,9", b",10,9", "bad.csv:3:1: column time_s: expected a finite number, found nothing; give a number or delete the row"),
    ("km/h given as m/s", PAIR, b"0.1,10,9", b"0.1,100,9", "bad.csv:3:5: column lead_speed_mps: expected at most 90 m/s, found 100; looks like km/h: divide by 3.6"),
    ("driving backwards", PAIR, b"0.1,10,9", b"0.1,10,-3", "bad.csv:3:8: column speed_mps: expected at least -0.5 m/s, found -3; speeds count forwards: check the sign, or leave the field empty"),
    ("truncated last line", PAIR, b"0.2,10,9,20.2\n", b"0.2,10,9", "bad.csv:4:1: expected 4 fields as in the header, found 3; the last line is cut off: delete it, or copy the file again"),
    ("decimal commas", PAIR, b"0.1,10,9,20.1", b"0,1,10,9,20,1", "bad.csv:3:1: expected 4 fields as in the header, found 6; write decimal numbers with a point, and no separator within a number"),
    ("semicolons", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"time_s;lead_speed_mps;speed_mps;spacing_m", "bad.csv:1:7: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file, or read it by a column map (--columns) with separator = \"semicolon\"; decimal = \"comma\" there reads decimal commas"),
    ("one row", PAIR, b"0.1,10,9,20.1\n0.2,10,9,20.2\n", b"", "bad.csv:2: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", PAIR, b"0,10,9,20\n0.1,10,9,20.1\n0.2,10,9,20.2\n", b"", "bad.csv:1: the file ends after its header; expected rows of numbers"),
    ("misspelt column", PAIR, b"spacing_m", b"spacing", "bad.csv:1: column spacing_m is missing; the file has time_s, lead_speed_mps, speed_mps, spacing (needed: time_s, speed_mps, spacing_m, lead_speed_mps); rename spacing to spacing_m? Or read the table by a column map (`leadlag list columns`)"),
    ("misspelt optional column", PAIR, b"time_s,", b"lead_positon_m,time_s,", "bad.csv:1:1: column lead_positon_m is unknown; did you mean lead_position_m? Rename it"),
    ("column twice", PAIR, b"time_s,", b"speed_mps,time_s,", "bad.csv:1:33: column speed_mps appears twice; remove or rename one"),
    ("two unknown names", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"t,lead_speed_mps,speed_mps,Distance", "bad.csv:1: columns time_s and spacing_m are missing; the file has t, lead_speed_mps, speed_mps, Distance (needed: time_s, speed_mps, spacing_m, lead_speed_mps); rename t to time_s and Distance to spacing_m? Or read the table by a column map (`leadlag list columns`)"),
    ("unknown names", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"time,lead_speed,speed,spacing", "bad.csv:1: columns time_s, speed_mps, spacing_m and lead_speed_mps are missing; the file has time, lead_speed, speed, spacing; rename time to time_s, speed to speed_mps, spacing to spacing_m and lead_speed to lead_speed_mps? Or read the table by a column map (`leadlag list columns`)"),
    ("names that say km/h", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"Timestamp,LV_kmh,FV_kmh,Gap_m", "bad.csv:1: columns time_s, speed_mps, spacing_m and lead_speed_mps are missing; the file has Timestamp, LV_kmh, FV_kmh, Gap_m; rename Timestamp to time_s and Gap_m to spacing_m? Speeds are needed in m/s: divide LV_kmh and FV_kmh by 3.6, or give the unit in a map. Or read the table by a column map (`leadlag list columns`)"),
    ("other names", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"time,v_lead,v_follow,gap", "bad.csv:1: columns time_s, speed_mps, spacing_m and lead_speed_mps are missing; the file has time, v_lead, v_follow, gap; rename time to time_s, v_follow to speed_mps, gap to spacing_m and v_lead to lead_speed_mps? Or read the table by a column map (`leadlag list columns`)"),
    ("other names, one of them in capitals", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"Time,v_lead,v_follow,gap", "bad.csv:1: columns time_s, speed_mps, spacing_m and lead_speed_mps are missing; the file has Time, v_lead, v_follow, gap; rename Time to time_s, v_follow to speed_mps, gap to spacing_m and v_lead to lead_speed_mps? Or read the table by a column map (`leadlag list columns`)"),
    ("one name that stands for something", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"frame,a,b,gap", "bad.csv:1: no known layout has the columns frame, a, b, gap; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with --columns (`leadlag list columns`, or a file of your own)"),
    ("no header", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m\n", b"", "bad.csv:1: the header line is missing, the first line has numbers: 0, 10, 9, 20; put a line with the names of the columns before it, for a pair time_s,lead_speed_mps,speed_mps,spacing_m in the order of the file, or give them as header = [...] in a column map (--columns)"),
    ("tabs", PAIR, b"time_s,lead_speed_mps,speed_mps,spacing_m", b"time_s\tlead_speed_mps\tspeed_mps\tspacing_m", "bad.csv:1:7: the fields are separated by tabs; expected commas, and a point in decimal numbers: convert the file, or read it by a column map (--columns) with separator = \"tab\"; decimal = \"comma\" there reads decimal commas"),
    ("one field too many", PAIR, b"0.1,10,9,20.1", b"0.1,10,9,20.1,7", "bad.csv:3:1: expected 4 fields as in the header, found 5; write decimal numbers with a point, and no separator within a number"),
    ("one field too few", PAIR, b"0.1,10,9,20.1", b"0.1,10,9", "bad.csv:3:1: expected 4 fields as in the header, found 3; complete the row (empty fields mean missing values), or delete it"),
    ("quoted decimal comma", PAIR, b"0.1,10,9", b"\"0,1\",10,9", "bad.csv:3:1: column time_s: expected a finite number, found \"0,1\"; write decimal numbers with a point"),
    ("an unknown word", PAIR, b"0.1,10,9", b"0.1,LOST,9", "bad.csv:3:5: column lead_speed_mps: expected a finite number, found \"LOST\"; leave the field empty if the value is missing"),
    ("grade in per cent", PAIR, b"spacing_m\n0,10,9,20\n0.1,10,9,20.1\n0.2,10,9,20.2\n", b"spacing_m,sin_grade\n0,10,9,20,0\n0.1,10,9,20,3.5\n", "bad.csv:3:13: column sin_grade: expected the sine of the grade, between -0.5 and 0.5, found 3.5; divide by 100 if it is in per cent"),
    ("line ends of old Macs", PAIR, b"spacing_m\n0,10,9,20\n", b"spacing_m\r0,10,9,20\r", "bad.csv:1:42: a carriage return inside a line; expected line endings LF or CRLF: convert the line endings of the file"),
    ("latin-1 letter", PAIR, b"0.1,10,9", b"0.1,1\xE9,9", "bad.csv:3:6: byte 0xE9 is not text; expected CSV in UTF-8: convert the file, or unpack it if it is compressed"),
    ("wrong header", OPENACC, b"Date,1,2,2020", b"Day,1,2,2020", "bad.csv:1: no known layout has the columns Day, 1, 2, 2020; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with --columns (`leadlag list columns`, or a file of your own)"),
    ("missing column", OPENACC, b"IVS1", b"Lat1", "bad.csv:6: column IVS1 is missing; the file has Time, Speed1, E1, N1, Speed2, E2, N2, Lat1, Driver2 (needed: Time, Speed1, Speed2, IVS1)"),
    ("text in a number", OPENACC, b"1.1,10,", b"1.1,fast,", "bad.csv:8:5: column Speed1: expected a finite number, found \"fast\"; leave the field empty if the value is missing"),
    ("infinite", OPENACC, b"1.1,10,", b"1.1,-inf,", "bad.csv:8:5: column Speed1: expected a finite number, found \"-inf\"; leave the field empty if the value is missing"),
    ("time going back", OPENACC, b"1.2,10", b"1.05,10", "bad.csv:9:1: Time: expected a time after 1.1, found 1.05; time runs backwards: sort the rows, or split the file here"),
    ("duplicate time", OPENACC, b"1.2,10", b"1.1,10", "bad.csv:9:1: Time: expected a time after 1.1, found 1.1 again, first in line 8; the two rows differ: remove one of them"),
    ("missing time", OPENACC, b"1.1,10,", b",10,", "bad.csv:8:1: column Time: expected a finite number, found nothing; give a number or delete the row"),
    ("km/h given as m/s", OPENACC, b"1.1,10,", b"1.1,120,", "bad.csv:8:5: column Speed1: expected at most 90 m/s, found 120; looks like km/h: divide by 3.6"),
    ("driving backwards", OPENACC, b"1.1,10,", b"1.1,-10,", "bad.csv:8:5: column Speed1: expected at least -0.5 m/s, found -10; speeds count forwards: check the sign, or leave the field empty"),
    ("truncated last line", OPENACC, b"1.2,10,0,0,9,-25,0,20.2,ACC\r\n", b"1.2,10,0,0,9,-2", "bad.csv:9:1: expected 9 fields as in the header, found 6; the last line is cut off: delete it, or copy the file again"),
    ("decimal commas", OPENACC, b"1.1,10,0,0,9,-25,0,20.1,ACC", b"1,1,10,0,0,0,0,9,0,-25,0,0,20,1,ACC", "bad.csv:8:1: expected 9 fields as in the header, found 15; write decimal numbers with a point, and no separator within a number"),
    ("semicolons", OPENACC, b"Date,1,2,2020", b"Date;1;2;2020", "bad.csv:1:5: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file"),
    ("one row", OPENACC, b"1.1,10,0,0,9,-25,0,20.1,ACC\r\n1.2,10,0,0,9,-25,0,20.2,ACC\r\n", b"", "bad.csv:7: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", OPENACC, b"1.0,10,0,0,9,-25,0,20,ACC\r\n1.1,10,0,0,9,-25,0,20.1,ACC\r\n1.2,10,0,0,9,-25,0,20.2,ACC\r\n", b"", "bad.csv:6: the file ends after its header; expected rows of numbers"),
    ("metadata line lost", OPENACC, b"ACC,1\r\n", b"", "bad.csv:4:1: expected the metadata line \"ACC,...\", found \"Distance_setting,min\"; OpenACC files have 5 such lines before the header: restore them"),
    ("only metadata", OPENACC, b"Time,Speed1,E1,N1,Speed2,E2,N2,IVS1,Driver2\r\n1.0,10,0,0,9,-25,0,20,ACC\r\n1.1,10,0,0,9,-25,0,20.1,ACC\r\n1.2,10,0,0,9,-25,0,20.2,ACC\r\n", b"", "bad.csv:5: the file ends before its header; expected a header line and rows of numbers after the metadata"),
    ("misspelt speed", OPENACC, b"Speed2", b"Sped2", "bad.csv:6:19: column Sped2 is unknown; did you mean Speed2? Rename it"),
    ("only one car", OPENACC, b"Speed2", b"VE1", "bad.csv:6: column Speed2 is missing; the file has Time, Speed1, E1, N1, VE1, E2, N2, IVS1, Driver2 (needed: Time, Speed1, Speed2, IVS1)"),
    ("wrong header", REBUILT, b"Time,", b"Zeit,", "bad.csv:6: column Time is missing; the file has Zeit, Speed1, Speed2, IVS1 (needed: Time, Speed1, Speed2, IVS1)"),
    ("missing column", REBUILT, b"IVS1", b"Gap1", "bad.csv:6: column IVS1 is missing; the file has Time, Speed1, Speed2, Gap1 (needed: Time, Speed1, Speed2, IVS1); rename Gap1 to IVS1?"),
    ("text in a number", REBUILT, b"1.1,10,", b"1.1,--,", "bad.csv:8:5: column Speed1: expected a finite number, found \"--\"; leave the field empty if the value is missing"),
    ("infinite", REBUILT, b"1.1,10,", b"1.1,infinity,", "bad.csv:8:5: column Speed1: expected a finite number, found \"infinity\"; leave the field empty if the value is missing"),
    ("time going back", REBUILT, b"1.2,10", b"1.05,10", "bad.csv:9:1: Time: expected a time after 1.1, found 1.05; time runs backwards: sort the rows, or split the file here"),
    ("duplicate time", REBUILT, b"1.2,10", b"1.1,10", "bad.csv:9:1: Time: expected a time after 1.1, found 1.1 again, first in line 8; the two rows differ: remove one of them"),
    ("missing time", REBUILT, b"1.1,10,", b",10,", "bad.csv:8:1: column Time: expected a finite number, found nothing; give a number or delete the row"),
    ("km/h given as m/s", REBUILT, b"1.1,10,", b"1.1,95.5,", "bad.csv:8:5: column Speed1: expected at most 90 m/s, found 95.5; looks like km/h: divide by 3.6"),
    ("driving backwards", REBUILT, b"1.1,10,", b"1.1,-0.6,", "bad.csv:8:5: column Speed1: expected at least -0.5 m/s, found -0.6; speeds count forwards: check the sign, or leave the field empty"),
    ("truncated last line", REBUILT, b"1.2,10,9,20.2\n", b"1.2,10", "bad.csv:9:1: expected 4 fields as in the header, found 2; the last line is cut off: delete it, or copy the file again"),
    ("decimal commas", REBUILT, b"1.1,10,9,20.1", b"1,1,10,0,9,0,20,1", "bad.csv:8:1: expected 4 fields as in the header, found 8; write decimal numbers with a point, and no separator within a number"),
    ("semicolons", REBUILT, b"Time,Speed1,Speed2,IVS1", b"Time;Speed1;Speed2;IVS1", "bad.csv:6:5: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file"),
    ("one row", REBUILT, b"1.1,10,9,20.1\n1.2,10,9,20.2\n", b"", "bad.csv:7: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", REBUILT, b"1.0,10,9,20\n1.1,10,9,20.1\n1.2,10,9,20.2\n", b"", "bad.csv:6: the file ends after its header; expected rows of numbers"),
    ("wrong header", PROCESSED, b"Time,X1,X2,SpeedDoppler1,SpeedDoppler2,Accel1,Accel2,Spacing2", b"a,b,c,d,e,f,g,h", "bad.csv:1: no known layout has the columns a, b, c, d, e, f, g, h; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with --columns (`leadlag list columns`, or a file of your own)"),
    ("missing column", PROCESSED, b"Spacing2", b"Gap2", "bad.csv:1: column Spacing2 is missing; the file has Time, X1, X2, SpeedDoppler1, SpeedDoppler2, Accel1, Accel2, Gap2 (needed: Time, X1, X2, SpeedDoppler1, SpeedDoppler2, Spacing2); rename Gap2 to Spacing2? Or read the table by a column map (`leadlag list columns`)"),
    ("text in a number", PROCESSED, b"1.1,101,", b"1.1,x,", "bad.csv:3:5: column X1: expected a finite number, found \"x\"; leave the field empty if the value is missing"),
    ("infinite", PROCESSED, b"1.1,101,", b"1.1,1e999,", "bad.csv:3:5: column X1: expected a finite number, found \"1e999\"; leave the field empty if the value is missing"),
    ("time going back", PROCESSED, b"1.2,102", b"1.05,102", "bad.csv:4:1: Time: expected a time after 1.1, found 1.05; time runs backwards: sort the rows, or split the file here"),
    ("duplicate time", PROCESSED, b"1.2,102", b"1.1,102", "bad.csv:4:1: Time: expected a time after 1.1, found 1.1 again, first in line 3; the two rows differ: remove one of them"),
    ("missing time", PROCESSED, b"1.1,101,", b",101,", "bad.csv:3:1: column Time: expected a finite number, found nothing; give a number or delete the row"),
    ("km/h given as m/s", PROCESSED, b"1.1,101,76,10", b"1.1,101,76,100", "bad.csv:3:12: column SpeedDoppler1: expected at most 90 m/s, found 100; looks like km/h: divide by 3.6"),
    ("driving backwards", PROCESSED, b"1.1,101,76,10", b"1.1,101,76,-7", "bad.csv:3:12: column SpeedDoppler1: expected at least -0.5 m/s, found -7; speeds count forwards: check the sign, or leave the field empty"),
    ("truncated last line", PROCESSED, b"1.2,102,77,10,9,0,0,20.2\n", b"1.2,102,77", "bad.csv:4:1: expected 8 fields as in the header, found 3; the last line is cut off: delete it, or copy the file again"),
    ("decimal commas", PROCESSED, b"1.1,101,76,10,9,0,0,20.1", b"1,1,101,76,10,9,0,0,20,1", "bad.csv:3:1: expected 8 fields as in the header, found 10; write decimal numbers with a point, and no separator within a number"),
    ("semicolons", PROCESSED, b"Time,X1,X2,SpeedDoppler1,SpeedDoppler2,Accel1,Accel2,Spacing2", b"Time;X1;X2;SpeedDoppler1;SpeedDoppler2;Accel1;Accel2;Spacing2", "bad.csv:1:5: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file, or read it by a column map (--columns) with separator = \"semicolon\"; decimal = \"comma\" there reads decimal commas"),
    ("one row", PROCESSED, b"1.1,101,76,10,9,0,0,20.1\n1.2,102,77,10,9,0,0,20.2\n", b"", "bad.csv:2: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", PROCESSED, b"1.0,100,75,10,9,0,0,20\n1.1,101,76,10,9,0,0,20.1\n1.2,102,77,10,9,0,0,20.2\n", b"", "bad.csv:1: the file ends after its header; expected rows of numbers"),
    ("wrong header", ULTRA, b"Trajectory_ID,Time_Index,Speed_LV,Speed_FAV,Spatial_Gap", b"a,b,c,d,e", "bad.csv:1: no known layout has the columns a, b, c, d, e; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with --columns (`leadlag list columns`, or a file of your own)"),
    ("missing column", ULTRA, b"Spatial_Gap", b"Gap", "bad.csv:1: column Spatial_Gap is missing; the file has Trajectory_ID, Time_Index, Speed_LV, Speed_FAV, Gap (needed: Trajectory_ID, Time_Index, Speed_LV, Speed_FAV, Spatial_Gap); rename Gap to Spatial_Gap? Or read the table by a column map (`leadlag list columns`)"),
    ("text in a number", ULTRA, b"0,0.2,10", b"0,0.2,ten", "bad.csv:3:7: column Speed_LV: expected a finite number, found \"ten\"; leave the field empty if the value is missing"),
    ("infinite", ULTRA, b"0,0.2,10", b"0,0.2,inf", "bad.csv:3:7: column Speed_LV: expected a finite number, found \"inf\"; leave the field empty if the value is missing"),
    ("time going back", ULTRA, b"0,0.3,10", b"0,0.15,10", "bad.csv:4:3: Time_Index: expected a time after 0.2, found 0.15; time runs backwards: sort the rows, or split the file here"),
    ("duplicate time", ULTRA, b"0,0.3,10", b"0,0.2,10", "bad.csv:4:3: Time_Index: expected a time after 0.2, found 0.2 again, first in line 3; the two rows differ: remove one of them"),
    ("missing time", ULTRA, b"0,0.2,10", b"0,,10", "bad.csv:3:3: column Time_Index: expected a finite number, found nothing; give a number or delete the row"),
    ("km/h given as m/s", ULTRA, b"0,0.2,10", b"0,0.2,99", "bad.csv:3:7: column Speed_LV: expected at most 90 m/s, found 99; looks like km/h: divide by 3.6"),
    ("driving backwards", ULTRA, b"0,0.2,10", b"0,0.2,-9", "bad.csv:3:7: column Speed_LV: expected at least -0.5 m/s, found -9; speeds count forwards: check the sign, or leave the field empty"),
    ("truncated last line", ULTRA, b"1,0.1,10,9,20.3\n", b"1,0.1,10", "bad.csv:5:1: expected 5 fields as in the header, found 3; the last line is cut off: delete it, or copy the file again"),
    ("decimal commas", ULTRA, b"0,0.2,10,9,20.1", b"0,0,2,10,9,20,1", "bad.csv:3:1: expected 5 fields as in the header, found 7; write decimal numbers with a point, and no separator within a number"),
    ("semicolons", ULTRA, b"Trajectory_ID,Time_Index,Speed_LV,Speed_FAV,Spatial_Gap", b"Trajectory_ID;Time_Index;Speed_LV;Speed_FAV;Spatial_Gap", "bad.csv:1:14: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file, or read it by a column map (--columns) with separator = \"semicolon\"; decimal = \"comma\" there reads decimal commas"),
    ("one row", ULTRA, b"0,0.2,10,9,20.1\n0,0.3,10,9,20.2\n1,0.1,10,9,20.3\n", b"", "bad.csv:2: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", ULTRA, b"0,0.1,10,9,20\n0,0.2,10,9,20.1\n0,0.3,10,9,20.2\n1,0.1,10,9,20.3\n", b"", "bad.csv:1: the file ends after its header; expected rows of numbers"),
    ("misspelt column", ULTRA, b"Spatial_Gap", b"Spacial_Gap", "bad.csv:1: column Spatial_Gap is missing; the file has Trajectory_ID, Time_Index, Speed_LV, Speed_FAV, Spacial_Gap (needed: Trajectory_ID, Time_Index, Speed_LV, Speed_FAV, Spatial_Gap); rename Spacial_Gap to Spatial_Gap? Or read the table by a column map (`leadlag list columns`)"),
    ("missing column", GRADE, b"X,Y", b"X,Z", "bad.csv:1: column Y is missing; the file has X, Z (needed: X, Y)"),
    ("text in a number", GRADE, b"2.5,0.01", b"2.5,steep", "bad.csv:3:5: column Y: expected a finite number, found \"steep\"; give a number or delete the row"),
    ("missing value", GRADE, b"2.5,0.01", b"2.5,", "bad.csv:3:5: column Y: expected a finite number, found nothing; give a number or delete the row"),
    ("position going back", GRADE, b"5,0.02", b"2,0.02", "bad.csv:4:1: column X: expected a position after 2.5 m, found 2; sort the rows and remove duplicates"),
    ("degrees", GRADE, b"2.5,0.01", b"2.5,1.2", "bad.csv:3:5: column Y: expected the sine of the grade, between -0.5 and 0.5, found 1.2; divide by 100 if it is in per cent"),
    ("track does not start at 0", GRADE, b"0,0\n", b"1,0\n", "bad.csv:2:1: column X: expected the track to start at 0 m, found 1; columns X and Y describe a closed track, position_m and sin_grade an open road"),
    ("one row", GRADE, b"2.5,0.01\n5,0.02\n", b"", "bad.csv:2: expected at least 2 rows of numbers, found 1; a trajectory needs more"),
    ("header only", GRADE, b"0,0\n2.5,0.01\n5,0.02\n", b"", "bad.csv:1: the file ends after its header; expected rows of numbers"),
    ("truncated last line", GRADE, b"5,0.02\n", b"5", "bad.csv:4:1: expected 2 fields as in the header, found 1; the last line is cut off: delete it, or copy the file again"),
    ("semicolons", GRADE, b"X,Y", b"X;Y", "bad.csv:1:2: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file"),
    ("wrong header", GRADE, b"X,Y", b"a,b", "bad.csv:1: columns position_m and sin_grade are missing; the file has a, b"),
    ("missing column", LABELS, b"length5", b"len5", "bad.csv:1: column length5 is missing; the file has File, type1, type2, type3, type4, type5, length1, length2, length3, length4, len5 (needed: File, type1, type2, type3, type4, type5, length1, length2, length3, length4, length5)"),
    ("text in a number", LABELS, b"4.706", b"long", "bad.csv:2:23: column length2: expected a finite number, found \"long\"; give a number or delete the row"),
    ("length in mm", LABELS, b"4.706", b"4706", "bad.csv:2:23: column length2: expected a length between 0.5 and 30 m, found 4706; the unit is m"),
    ("truncated last line", LABELS, b",4.464\n", b"", "bad.csv:2:1: expected 11 fields as in the header, found 10; the last line is cut off: delete it, or copy the file again"),
    ("semicolons", LABELS, b"File,type1,type2,type3,type4,type5,length1,length2,length3,length4,length5", b"File;type1;type2;type3;type4;type5;length1;length2;length3;length4;length5", "bad.csv:1:5: the fields are separated by semicolons; expected commas, and a point in decimal numbers: convert the file"),
    ("no time column", OPENACC, b"Time,", b"time,", "bad.csv:6: column Time is missing; the file has time, Speed1, E1, N1, Speed2, E2, N2, IVS1, Driver2 (needed: Time, Speed1, Speed2, IVS1); rename time to Time?"),
    ("an underscore too many", PROCESSED, b"SpeedDoppler2", b"Speed_Doppler2", "bad.csv:1: column SpeedDoppler2 is missing; the file has Time, X1, X2, SpeedDoppler1, Speed_Doppler2, Accel1, Accel2, Spacing2 (needed: Time, X1, X2, SpeedDoppler1, SpeedDoppler2, Spacing2); rename Speed_Doppler2 to SpeedDoppler2? Or read the table by a column map (`leadlag list columns`)"),
    ("spacing in mm", PAIR, b"20.1", b"20100", "bad.csv:3:10: column spacing_m: expected at most 10000 m in size, found 20100; check the unit, or leave the field empty"),
    ("absurd position", PROCESSED, b"1.1,101,", b"1.1,-4e9,", "bad.csv:3:5: column X1: expected at most 1000000000 m in size, found -4000000000; check the unit, or leave the field empty"),
];

#[test]
fn every_broken_file_is_refused_with_its_exact_message() {
    let mut failures = Vec::new();
    for &(what, base, from, to, expected) in CASES {
        let found = message(base.1, broken(base, from, to).as_slice());
        if found != expected {
            failures.push(format!("{}: {what}\n  expected {expected}\n  found    {found}", base.0));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(CASES.len() >= 100, "{}", CASES.len());
}

#[test]
fn gaps_that_are_not_above_0_count_as_missing_unless_all_are() {
    for (base, signal, place) in [
        (PAIR, "spacing_m", "2:8"),
        (OPENACC, "IVS1", "7:20"),
        (REBUILT, "IVS1", "7:10"),
        (PROCESSED, "Spacing2", "2:21"),
        (ULTRA, "Spatial_Gap", "2:12"),
    ] {
        let text = std::str::from_utf8(base.2.as_bytes()).expect("UTF-8");
        for bad in ["-0.5", "0", "-20.1"] {
            let recording = import::read_bytes(text.replacen("20.1", bad, 1).as_bytes(), "bad.csv", None);
            let platoon = recording.unwrap_or_else(|error| panic!("{}: {error}", base.0)).platoons.remove(0);
            let gap = platoon.cars[1].gap.as_ref().expect("it has a gap");
            assert!(gap[1].is_nan() && gap[0] == 20.0 && gap[2] == 20.2, "{}: {gap:?}", base.0);
            let note = Note::NoGap { car: 2, signal: signal.to_owned(), samples: 1 };
            assert!(platoon.notes.contains(&note), "{}: {:?}", base.0, platoon.notes);
        }
        // Ultra-AV has a second trajectory, of which one row is left.
        let none = text.replace(",20", ",-20");
        let expected = format!(
            "bad.csv:{place}: column {signal}: expected a spacing above 0 m, found -20, and none above 0; check that it is \
             bumper to bumper, and its sign"
        );
        let said = message(base.1, none.as_bytes());
        assert_eq!(said.lines().next(), Some(expected.as_str()), "{}", base.0);
    }
}

#[test]
fn a_row_that_repeats_another_one_is_taken_once() {
    for base in [PAIR, OPENACC, REBUILT, PROCESSED, ULTRA] {
        let mut lines: Vec<&str> = base.2.lines().collect();
        // The second of the rows of numbers, again at the end of the first trajectory.
        let first = lines.len() - if base.0 == "ultra-av" { 4 } else { 3 };
        lines.insert(first + 3, lines[first + 1]);
        let text = lines.join("\n") + "\n";
        let recording = import::read_bytes(text.as_bytes(), "twice.csv", None);
        let platoon = recording.unwrap_or_else(|error| panic!("{}: {error}", base.0)).platoons.remove(0);
        assert_eq!(platoon.t.len(), 3, "{}", base.0);
        let note = Note::RowsRepeated { rows: 1, line: first as u64 + 4 };
        assert!(platoon.notes.contains(&note), "{}: {:?}", base.0, platoon.notes);
    }
}

#[test]
fn a_follower_with_broken_values_does_not_cost_the_others() {
    let mut text = "Time,Speed1,Speed2,Speed3,IVS1,IVS2\n".to_owned();
    for k in 0..50 {
        let far = if k == 20 { "far" } else { "30" };
        text += &format!("{:.1},10,10,10,20,{far}\n", f64::from(k) * 0.1);
    }
    let recording = import::read_bytes(text.as_bytes(), "p.csv", None).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(prepare(&recording, 1, &Preparation::default()).expect("it is sound")[0].len(), 50);
    let expected = "p.csv:22:17: column IVS2: expected a finite number, found \"far\"; leave the field empty if the value is missing\n\
                    p.csv: follower 2 cannot be used; followers that can: 1";
    let error = prepare(&recording, 2, &Preparation::default()).expect_err("it is broken");
    assert_eq!(error.to_string(), expected);
    assert!(inspect(&recording).to_string().contains("cannot be calibrated: p.csv:22:17"));
    // The speed of the car between two others is needed by both of their pairs.
    let both = text.replacen("2.0,10,10,10,20,far", "2.0,10,fast,10,20,30", 1);
    let said = message(Reader::Detect, both.as_bytes());
    assert!(said.starts_with("bad.csv:22:8: column Speed2: expected a finite number, found \"fast\""), "{said}");
}

const READERS: [Reader; 8] = [
    Reader::Detect,
    Reader::As(Layout::OpenAcc),
    Reader::As(Layout::AstazeroRebuilt),
    Reader::As(Layout::AstazeroProcessed),
    Reader::As(Layout::UltraAv),
    Reader::As(Layout::Pair),
    Reader::Grade,
    Reader::Labels,
];

#[test]
fn files_that_are_no_csv_at_all_are_refused_by_every_reader() {
    let cases: [(&[u8], &str); 6] = [
        (b"", "bad.csv:1: the file is empty; expected a header line and rows of numbers"),
        (
            b"\x89PNG\r\n\x1A\n\0\0\0\rIHDR",
            "bad.csv:1:1: byte 0x89 is not text; expected CSV in UTF-8: convert the file, or unpack it if it is compressed",
        ),
        (
            b"\x1F\x8B\x08\0\0\0",
            "bad.csv:1:1: this is compressed by gzip; expected a table as text, CSV in UTF-8: unpack it, or give the path of its file",
        ),
        (
            b"time_s,\0\0\0\n",
            "bad.csv:1:8: byte 0x00 is not text; expected CSV in UTF-8: convert the file, or unpack it if it is compressed",
        ),
        (b"\xFF\xFEt\0i\0m\0e\0_\0s\0,\0", "bad.csv:1:1: the file is UTF-16; expected UTF-8: save it again as UTF-8"),
        (
            b"time_s\tspeed_mps\n0\t1\n",
            "bad.csv:1:7: the fields are separated by tabs; expected commas, and a point in decimal numbers: convert the file",
        ),
    ];
    for reader in READERS {
        for (bytes, expected) in cases {
            let said = message(reader, bytes);
            // For tables that a column map could read, the message continues with that hint.
            let (said, more) = said.split_once(", or read it by a column map").unwrap_or((&said, ""));
            assert_eq!(said, expected, "{reader:?}");
            let is_measured = !matches!(reader, Reader::Grade | Reader::Labels);
            assert_eq!(more.contains("separator"), is_measured && bytes.contains(&b'\t'), "{reader:?}: {more}");
        }
    }
}

/// Counts the bytes that are taken from it.
struct Counted<R> {
    inner: R,
    bytes: u64,
}

impl<R: Read> Read for &mut Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let bytes = self.inner.read(buffer)?;
        self.bytes += bytes as u64;
        Ok(bytes)
    }
}

#[test]
fn a_line_of_one_gigabyte_is_refused_after_its_first_mebibyte() {
    const GIGABYTE: u64 = 1 << 30;
    let expected = |line| {
        format!("bad.csv:{line}: the line is longer than 1048576 bytes; expected rows of CSV: is this the right file?")
    };
    for reader in READERS {
        let mut input = Counted { inner: std::io::repeat(b'1').take(GIGABYTE), bytes: 0 };
        assert_eq!(message(reader, &mut input), expected(1), "{reader:?}");
        assert!(input.bytes < 2 << 20, "{} bytes read", input.bytes);
    }
    // The same in a row of an otherwise good file.
    for base in [PAIR, OPENACC, REBUILT, PROCESSED, ULTRA, GRADE, LABELS] {
        let line = std::io::repeat(b'1').take(GIGABYTE);
        let mut input = Counted { inner: Cursor::new(base.2).chain(line), bytes: 0 };
        let lines = base.2.lines().count() + 1;
        assert_eq!(message(base.1, &mut input), expected(lines), "{}", base.0);
        assert!(input.bytes < 2 << 20, "{} bytes read", input.bytes);
    }
}

#[test]
fn the_first_ten_problems_are_reported_and_the_others_counted() {
    let mut text = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for i in 0..13 {
        text += &format!("{i},10,?,20\n");
    }
    let found = message(Reader::Detect, text.as_bytes());
    let lines: Vec<&str> = found.lines().collect();
    assert_eq!(lines.len(), 11);
    for (i, line) in lines[..10].iter().enumerate() {
        let column = if i < 10 { 6 } else { 7 };
        let place = format!("bad.csv:{}:{column}: ", i + 2);
        let expected =
            "column speed_mps: expected a finite number, found \"?\"; leave the field empty if the value is missing";
        assert_eq!(*line, place + expected);
    }
    assert_eq!(lines[10], "bad.csv: and 3 more problems");
}

#[test]
fn columns_count_characters_not_bytes() {
    let bytes = broken(OPENACC, b"1.1,10,0,0,9,-25,0,20.1,ACC", "1.1,10,\u{e9}\u{e9},0,9,-25,0,?,ACC".as_bytes());
    let found = message(Reader::Detect, bytes.as_slice());
    assert!(found.starts_with("bad.csv:8:21: column IVS1: "), "{found}");
}

#[test]
fn harmless_differences_are_accepted() {
    let crlf = PAIR.2.replace('\n', "\r\n");
    let quoted = PAIR.2.replace("time_s", "\"time_s\"").replace("\n0.1,10", "\n\"0.1\", 10");
    let cases: [(&str, String); 12] = [
        ("comments before the header", format!("# logger 3\n% lap 2\n\n{}", PAIR.2)),
        ("a header that is a comment", format!("# {}", PAIR.2)),
        ("a row of units", PAIR.2.replacen("spacing_m\n", "spacing_m\n[s],[m/s],[m/s],[m]\n", 1)),
        ("words for missing values", PAIR.2.replace("20.1", "NA").replace("20.2", "#N/A")),
        ("byte order mark", format!("\u{feff}{}", PAIR.2)),
        ("CRLF", crlf),
        ("quotes and blanks", quoted),
        ("missing values", PAIR.2.replace("20.1", "").replace("20.2", "NaN")),
        ("no end of the last line", PAIR.2.trim_end().to_owned()),
        ("empty lines at the end", format!("{}\n,,,\n\n", PAIR.2)),
        ("trailing commas", PAIR.2.replace('\n', ",,\n")),
        (
            "unknown columns",
            PAIR.2
                .replace("spacing_m\n", "spacing_m,weather\n")
                .replace("20.1\n", "20.1,rain\n")
                .replace("20\n", "20,sun\n")
                .replace("20.2\n", "20.2,\n"),
        ),
    ];
    for (what, text) in cases {
        let recording = import::read_bytes(text.as_bytes(), "good.csv", None);
        let recording = recording.unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_eq!(recording.platoons[0].t, [0.0, 0.1, 0.2], "{what}");
    }
    for (base, layout) in [(OPENACC, Layout::OpenAcc), (REBUILT, Layout::AstazeroRebuilt)] {
        let bare = base.2.split_once("min").expect("it has metadata").1.trim_start();
        let recording = import::read_bytes(bare.as_bytes(), "bare.csv", None).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((recording.layout, recording.platoons[0].cars[1].name.as_str()), (layout, "car 2"), "no metadata");
    }
    for base in [OPENACC, REBUILT, PROCESSED, ULTRA, GRADE, LABELS] {
        assert_eq!(message(base.1, base.2.as_bytes()), "", "{}", base.0);
        let marked = format!("\u{feff}{}", base.2.replace('\r', "").replace('\n', "\r\n"));
        assert_eq!(message(base.1, marked.as_bytes()), "", "{} with mark and CRLF", base.0);
    }
}

#[test]
fn what_cannot_be_prepared_is_said() {
    let text = |step: f64, rows: u32| {
        let mut text = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
        for k in 0..rows {
            text += &format!("{},10,10,20\n", f64::from(k) * step);
        }
        text
    };
    let ordinary = Preparation::default;
    let cases: [(String, usize, Preparation, &str); 8] = [
        (
            text(0.1, 50),
            0,
            ordinary(),
            "p.csv: no follower 0: followers count from 1, the one right behind the platoon leader; followers with data: 1",
        ),
        (
            text(0.1, 50),
            3,
            ordinary(),
            "p.csv: no follower 3: car 4 or the car ahead of it is not in the file; followers with data: 1",
        ),
        (
            text(100.0, 50),
            1,
            ordinary(),
            "p.csv: expected a time step of at most 5 s, found 100; is the time in milliseconds?",
        ),
        (
            text(0.1, 10),
            1,
            ordinary(),
            "p.csv: follower 1: expected at least 2 s, the recording has 0.9 s; give a longer one",
        ),
        (text(0.1, 50), 1, Preparation { max_gap_s: f64::NAN, ..ordinary() }, "max gap: expected 0 to 60 s, found NaN"),
        (
            text(0.1, 50),
            1,
            Preparation { resample: Some(0.0), ..ordinary() },
            "resample: expected a step of 0.001 to 5 s, found 0",
        ),
        (
            text(0.1, 50),
            1,
            Preparation { from: Some(2.0), to: Some(1.0), ..ordinary() },
            "--to 1 lies before --from 2; swap them",
        ),
        (
            text(5.0, 2000),
            1,
            Preparation { resample: Some(0.001), max_gap_s: 5.0, ..ordinary() },
            "p.csv: resampling to 0.001 s gives 9995001 samples, more than 5000000; choose a longer step or a shorter window",
        ),
    ];
    for (text, follower, preparation, expected) in cases {
        let recording = import::read_bytes(text.as_bytes(), "p.csv", None);
        let recording = recording.unwrap_or_else(|error| panic!("{error}"));
        let error = prepare(&recording, follower, &preparation).unwrap_err();
        assert_eq!(error.to_string(), expected);
    }
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let path = common::data().join("no_such_file.csv");
    let error = import::read(&path, None).unwrap_err();
    assert_eq!(error.to_string(), format!("{}: expected a readable file", path.display()));
    assert!(std::error::Error::source(&error).is_some());
}

#[test]
fn a_folder_is_called_one() {
    let path = common::data();
    let error = import::read(&path, None).unwrap_err();
    let expected = format!("{}: expected a file, found a folder; name the files in it", path.display());
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_table_that_is_not_of_its_map_is_told_so_once() {
    let map = ColumnMap::find("ngsim").expect("shipped");
    let error = read_mapped_from(PAIR.2.as_bytes(), "bad.csv", &map).expect_err("another table");
    let message = error.to_string();
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.starts_with("bad.csv:1: columns ") && message.contains("Vehicle_ID, "), "{message}");
    assert!(message.contains(" are missing; the file has time_s, lead_speed_mps, speed_mps, spacing_m; "), "{message}");
    assert!(message.contains("is ngsim the right column map?"), "{message}");
}

/// A line of the longest length allowed, all of it column names, is refused at once.
#[test]
fn half_a_million_columns() {
    for layout in Layout::ALL {
        let metadata = matches!(layout, Layout::OpenAcc | Layout::AstazeroRebuilt);
        let before = if metadata { OPENACC.2.split("Time").next().expect("five lines") } else { "" };
        let line = before.matches('\n').count() + 1;
        let text = format!("{before}Time{}\n", ",c".repeat(500_000));
        let expected = format!(
            "bad.csv:{line}: expected at most 2000 columns, found 500001; is this the header of a measured file?"
        );
        assert_eq!(message(Reader::As(layout), text.as_bytes()), expected, "{layout}");
    }
}

/// A good map, of which each case replaces a piece.
const MAP: &str = r#"rows = "vehicles"
nobody = ["0"]
[columns]
time = { name = "t" }
id = { name = "car" }
ahead = { name = "front" }
speed = { name = "v", unit = "km/h" }
gap = { name = "gap" }
"#;

/// A piece of the map, its replacement, and the message.
const MAPS: &[(&str, &str, &str)] = &[
    (
        "rows = \"vehicles\"",
        "rows = \"cars\"",
        "map.toml:1:8: unknown variant `cars`, expected one of `vehicles`, `pairs`, `platoon`",
    ),
    (
        "rows = \"vehicles\"",
        "rows = \"vehicles\"\ndecimal = \"comma\"",
        "map.toml: decimal = \"comma\": expected another separator than the comma; set separator to semicolon, tab or whitespace",
    ),
    ("rows = \"vehicles\"\n", "", "map.toml:1:1: missing field `rows`"),
    (
        "rows =",
        "row =",
        "map.toml:1:1: unknown field `row`, expected one of `title`, `rows`, `separator`, `decimal`, `header`, `headerless`, `skip_lines`, `units_row`, `missing`, `nobody`, `direction`, `position_at`, `frame_rate`, `frame_rate_hz`, `check_units`, `length`, `lead_length`, `lap_length`, `columns`, `layout`",
    ),
    (
        "speed =",
        "sped =",
        "map.toml:7: [columns] has no sped; it takes time, id, ahead, group, lane, driver, position, speed, acceleration, length, gap, headway; did you mean speed?",
    ),
    (
        "gap =",
        "colour =",
        "map.toml:8: [columns] has no colour; it takes time, id, ahead, group, lane, driver, position, speed, acceleration, length, gap, headway",
    ),
    ("\"km/h\"", "\"kmh\"", "map.toml:7: speed: expected one of the units m/s, km/h, ft/s, mph, kn, cm/s, found kmh"),
    (
        "{ name = \"car\" }",
        "{ name = \"car\", unit = \"m\" }",
        "map.toml:5: id: expected no unit, because it is a name; found m",
    ),
    ("\"front\"", "[]", "map.toml:6: ahead: expected a name of a column, found none; write ahead = { name = \"...\" }"),
    ("\"front\"", "3", "map.toml:6:18: expected a name, or a list of names of which a file has one"),
    (
        "speed = { name = \"v\", unit = \"km/h\" }\n",
        "",
        "map.toml: [columns] needs speed, found only time, id, ahead, gap; speeds are not derived from positions",
    ),
    (
        "gap = { name = \"gap\" }\n",
        "",
        "map.toml: [columns] needs gap, or length with headway or position, found only time, id, ahead, speed; the bumper-to-bumper gap must follow from something; a length without a column is a number, length = 4.6, or lead_length = 4.6 in a table of pairs",
    ),
    (
        "ahead = { name = \"front\" }\n",
        "",
        "map.toml: [columns] needs ahead, or lane and position, found only time, id, speed, gap; every row must name the vehicle ahead, or give the place of the vehicle",
    ),
    (
        "{ name = \"t\" }",
        "{ name = \"t\", unit = \"frame\" }",
        "map.toml: time is in frames, so the map needs their rate: frame_rate_hz = 25",
    ),
    ("nobody = [\"0\"]", "frame_rate_hz = -25", "map.toml: frame_rate_hz: expected 0.2 to 1000 per second, found -25"),
    (
        "rows = \"vehicles\"",
        "rows = \"pairs\"",
        "map.toml:6: ahead: not in a table with rows = \"pairs\", which takes time, group, lane, driver, position, speed, acceleration, gap, headway, sin_grade, lead_speed, relative_speed, lead_position, lead_length, lead_acceleration, lead2_speed, lead2_gap",
    ),
    (
        "id = { name",
        "id = { names",
        "map.toml:5:8: unknown field `names`, expected one of `name`, `unit`, `optional`, `hint`",
    ),
];

/// A table for that map, pieces of it, and messages.
const MAPPED: &str = "t,car,front,v,gap\n0,a,0,72,\n1,a,0,72,\n2,a,0,72,\n0,b,a,72,20\n1,b,a,72,20\n2,b,a,72,20\n";
const TABLES: &[(&str, &str, &str)] = &[
    (
        "front",
        "frnt",
        "bad.csv:1: column front is missing; the file has t, car, frnt, v, gap (needed: t, car, front, v, gap); rename frnt to front?",
    ),
    (
        "0,b,a,72,20",
        "0,b,a,72",
        "bad.csv:5:1: expected 5 fields as in the header, found 4; complete the row (empty fields mean missing values), or delete it",
    ),
    (
        "0,b,a,72,20",
        "0,b,a,fast,20",
        "bad.csv:5:7: column v: expected a finite number, found \"fast\"; leave the field empty if the value is missing",
    ),
    (
        "0,b,a,72,20",
        ",b,a,72,20",
        "bad.csv:5:1: column t: expected a finite number, found nothing; give a number or delete the row",
    ),
    (
        "1,b,a,72,20",
        "1,b,a,360,20",
        "bad.csv:6:7: column v: expected at most 324 km/h, found 360; no road vehicle is faster: correct its unit in the column map",
    ),
    (
        "1,b,a,72,20",
        "0,b,a,72,21",
        "bad.csv:6: vehicle b is at 0 s for the second time, first in line 5, and the two rows differ; remove one of them, or name the column that distinguishes recordings as group in the column map",
    ),
    (
        "0,b,a,72,20\n1,b,a,72,20\n2,b,a,72,20\n",
        "0,b,c,72,20\n",
        "bad.csv:1: none of 2 vehicles follows another one of the table for 2 s, the longest for 0 s; is front the right column of the vehicle ahead?",
    ),
    (
        "2,b,a,72,20",
        "2,b,a,-72,20",
        "bad.csv:7: column v (km/h): expected at least -0.5 m/s forwards, found -20; for vehicles that drive towards lower positions set direction = \"by-speed\" in the column map",
    ),
];

#[test]
fn every_broken_column_map_is_refused_with_its_exact_message() {
    assert!(ColumnMap::parse(MAP, "map.toml").is_ok());
    let mut failures = Vec::new();
    for (from, to, expected) in MAPS {
        assert!(MAP.contains(from), "{from}");
        let error = ColumnMap::parse(&MAP.replacen(from, to, 1), "map.toml").expect_err(expected);
        let found = error.to_string();
        if found != *expected {
            failures.push(format!("expected {expected}\nfound    {found}"));
        }
    }
    let map = ColumnMap::parse(MAP, "map.toml").expect("a good map");
    for (from, to, expected) in TABLES {
        assert!(MAPPED.contains(from), "{from}");
        let text = MAPPED.replacen(from, to, 1);
        let found = read_mapped_from(text.as_bytes(), "bad.csv", &map).expect_err(expected).to_string();
        if found != *expected {
            failures.push(format!("expected {expected}\nfound    {found}"));
        }
    }
    for (given, expected) in [
        (
            "ngsm",
            "no column map ngsm; built in are ngsim, highd, exid, tgsim, i24-motion, waymo-pairs, fhwa-cav, sumo-fcd, your own map ends in .toml; did you mean ngsim?",
        ),
        ("nowhere.toml", "nowhere.toml: expected a readable column map"),
    ] {
        assert_eq!(ColumnMap::find(given).expect_err(expected).to_string(), expected);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(read_mapped_from(MAPPED.as_bytes(), "good.csv", &map).is_ok());
}
