//! Text that pages store as the difference of each value from the previous one (DELTA_LENGTH_BYTE_ARRAY, DELTA_BYTE_ARRAY), rewritten as PLAIN.
//! The library allocates and copies what such a page declares; here each length is checked, and memory holds the text of one page.

use super::pages::PAGE_MAX;
use crate::text::bounded::LINE_MAX;
use bytes::Bytes;
use parquet::basic::{Encoding, Type as Physical};
use parquet::bloom_filter::Sbbf;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{ParquetMetaData, RowGroupMetaData};
use parquet::file::reader::{FileReader, RowGroupReader};
use parquet::record::reader::RowIter;
use parquet::schema::types::{ColumnDescPtr, Type};

/// A file whose text is PLAIN or in a dictionary.
pub(super) struct PlainText<F>(pub F);

impl<F: FileReader> FileReader for PlainText<F> {
    fn metadata(&self) -> &ParquetMetaData {
        self.0.metadata()
    }

    fn num_row_groups(&self) -> usize {
        self.0.num_row_groups()
    }

    fn get_row_group(&self, i: usize) -> Result<Box<dyn RowGroupReader + '_>> {
        Ok(Box::new(Group(self.0.get_row_group(i)?)))
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>> {
        RowIter::from_file(projection, self)
    }
}

struct Group<'a>(Box<dyn RowGroupReader + 'a>);

impl RowGroupReader for Group<'_> {
    fn metadata(&self) -> &RowGroupMetaData {
        self.0.metadata()
    }

    fn num_columns(&self) -> usize {
        self.0.num_columns()
    }

    fn get_column_page_reader(&self, i: usize) -> Result<Box<dyn PageReader>> {
        let column = self.metadata().schema_descr().column(i);
        Ok(Box::new(PlainPages { pages: self.0.get_column_page_reader(i)?, column }))
    }

    fn get_column_bloom_filter(&self, i: usize) -> Option<&Sbbf> {
        self.0.get_column_bloom_filter(i)
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>> {
        RowIter::from_row_group(projection, self)
    }
}

struct PlainPages {
    pages: Box<dyn PageReader>,
    column: ColumnDescPtr,
}

impl Iterator for PlainPages {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Result<Page>> {
        self.get_next_page().transpose()
    }
}

impl PageReader for PlainPages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let Some(mut page) = self.pages.get_next_page()? else { return Ok(None) };
        rewrite(&mut page, &self.column)
            .map_err(|why| ParquetError::General(format!("column {}: {why}", self.column.path())))?;
        Ok(Some(page))
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.pages.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.pages.skip_next_page()
    }

    fn supports_deferred_dictionary(&self) -> bool {
        self.pages.supports_deferred_dictionary()
    }

    fn take_deferred_dictionary(&mut self) -> Result<Option<Page>> {
        self.pages.take_deferred_dictionary()
    }

    fn at_record_boundary(&mut self) -> Result<bool> {
        self.pages.at_record_boundary()
    }
}

/// Rewrites the values of a page behind its levels, if they are differences.
fn rewrite(page: &mut Page, column: &ColumnDescPtr) -> std::result::Result<(), String> {
    let (buffer, encoding, levels, count) = match page {
        Page::DataPage { buf, encoding, def_level_encoding, num_values, .. } if is_delta(*encoding) => {
            // A column of a table has one value a row, or none: it has no levels of repetition.
            let levels = match column.max_def_level() {
                0 => 0,
                _ if *def_level_encoding != Encoding::RLE => return Err("its missing values are not in RLE".to_owned()),
                _ => {
                    let (length, rest) = buf.split_first_chunk().ok_or(SHORT)?;
                    let length = usize::try_from(i32::from_le_bytes(*length)).map_err(|_| SHORT)?;
                    rest.get(length..).ok_or(SHORT)?;
                    length + 4
                }
            };
            (buf, encoding, levels, *num_values)
        }
        Page::DataPageV2 { buf, encoding, def_levels_byte_len, rep_levels_byte_len, num_values, .. }
            if is_delta(*encoding) =>
        {
            let levels = *def_levels_byte_len as usize + *rep_levels_byte_len as usize;
            (buf, encoding, levels, *num_values)
        }
        _ => return Ok(()),
    };
    if column.physical_type() != Physical::BYTE_ARRAY {
        return Err(format!("it has the encoding {encoding}, which leadlag reads of text only; expected PLAIN"));
    }
    let mut plain = buffer.get(..levels).ok_or(SHORT)?.to_vec();
    unpack(*encoding, &buffer[levels..], count, &mut plain)?;
    *buffer = Bytes::from(plain);
    *encoding = Encoding::PLAIN;
    Ok(())
}

fn is_delta(encoding: Encoding) -> bool {
    matches!(encoding, Encoding::DELTA_LENGTH_BYTE_ARRAY | Encoding::DELTA_BYTE_ARRAY)
}

const SHORT: &str = "a page ends before its values";
const LENGTHS: &str = "the lengths of the texts of a page contradict each other";

/// Appends the values in PLAIN encoding: each behind its length.
fn unpack(encoding: Encoding, data: &[u8], count: u32, plain: &mut Vec<u8>) -> std::result::Result<(), String> {
    let first = Integers::of(data)?;
    // Either the values are their lengths and bytes, or the first lengths are those of what a value shares with the previous one.
    let (shared, lengths) = match encoding {
        Encoding::DELTA_BYTE_ARRAY => (Some(first.clone()), Integers::of(first.rest()?)?),
        _ => (None, first),
    };
    if lengths.left > u64::from(count) || shared.as_ref().is_some_and(|shared| shared.left != lengths.left) {
        return Err(LENGTHS.to_owned());
    }
    let mut text = lengths.clone().rest()?;
    let mut shared = shared.into_iter().flatten();
    let mut previous = 0..0;
    for length in lengths {
        let own = take(&mut text, usize::try_from(length?).map_err(|_| LENGTHS)?)?;
        let same = usize::try_from(shared.next().transpose()?.unwrap_or(0)).map_err(|_| LENGTHS)?;
        let whole = same + own.len();
        if same > previous.len() || whole > LINE_MAX {
            return Err(LENGTHS.to_owned());
        }
        if plain.len() + 4 + whole > PAGE_MAX as usize {
            return Err(format!("a page holds more than {PAGE_MAX} bytes of text"));
        }
        plain.extend((whole as u32).to_le_bytes());
        let begin = plain.len();
        plain.extend_from_within(previous.start..previous.start + same);
        plain.extend_from_slice(own);
        previous = begin..plain.len();
    }
    Ok(())
}

fn take<'a>(data: &mut &'a [u8], length: usize) -> std::result::Result<&'a [u8], String> {
    let (taken, rest) = data.split_at_checked(length).ok_or(SHORT)?;
    *data = rest;
    Ok(taken)
}

/// Whole numbers as DELTA_BINARY_PACKED: blocks of miniblocks, each with its own number of bits; a number is the previous one plus the smallest
/// difference of the block plus these bits.
#[derive(Clone)]
struct Integers<'a> {
    /// Numbers that are not yet read.
    left: u64,
    is_first: bool,
    last: i32,
    /// Behind the present miniblock.
    data: &'a [u8],
    /// Miniblocks of a block, and numbers of a miniblock.
    shape: [usize; 2],
    least: i32,
    /// Bits of a number in each further miniblock of the block.
    widths: &'a [u8],
    packed: &'a [u8],
    width: usize,
    /// Numbers read from the present miniblock.
    read: usize,
}

/// The most numbers of a miniblock: writers use 32.
const MINIBLOCK_MAX: u64 = 1 << 16;

impl<'a> Integers<'a> {
    fn of(mut data: &'a [u8]) -> std::result::Result<Integers<'a>, String> {
        let [block, minis, left] = [varint(&mut data)?, varint(&mut data)?, varint(&mut data)?];
        let each = block.checked_div(minis).unwrap_or(0);
        // Whole bytes, whatever the width.
        if each == 0 || each % 8 != 0 || each > MINIBLOCK_MAX || each * minis != block {
            return Err("the blocks of the lengths of a page are invalid".to_owned());
        }
        let last = signed(&mut data)?;
        let shape = [minis as usize, each as usize];
        let (widths, packed) = (&data[..0], &data[..0]);
        Ok(Integers { left, is_first: true, last, data, shape, least: 0, widths, packed, width: 0, read: shape[1] })
    }

    /// The bytes behind the numbers.
    fn rest(mut self) -> std::result::Result<&'a [u8], String> {
        self.by_ref().try_for_each(|number| number.map(drop))?;
        Ok(self.data)
    }

    fn difference(&mut self) -> std::result::Result<i32, String> {
        let [minis, each] = self.shape;
        if self.read == each {
            if self.widths.is_empty() {
                self.least = signed(&mut self.data)?;
                self.widths = take(&mut self.data, minis)?;
            }
            let width = self.widths[0];
            if width > 32 {
                return Err(format!("a length of a page has {width} bits, expected at most 32"));
            }
            (self.width, self.widths, self.read) = (width.into(), &self.widths[1..], 0);
            self.packed = take(&mut self.data, self.width * each / 8)?;
        }
        let at = self.width * self.read;
        self.read += 1;
        let bytes = self.packed[at / 8..].iter().take(8).rev().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
        let bits = bytes >> (at % 8) & ((1_u64 << self.width) - 1);
        Ok(self.least.wrapping_add(bits as u32 as i32))
    }
}

impl Iterator for Integers<'_> {
    type Item = std::result::Result<i32, String>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        if !std::mem::take(&mut self.is_first) {
            match self.difference() {
                Ok(difference) => self.last = self.last.wrapping_add(difference),
                Err(why) => return Some(Err(why)),
            }
        }
        Some(Ok(self.last))
    }
}

/// Seven bits a byte, the lowest first.
fn varint(data: &mut &[u8]) -> std::result::Result<u64, String> {
    super::pages::varint(data).map_err(|_| SHORT.to_owned())
}

/// Zigzag encoding, of 32 bits.
fn signed(data: &mut &[u8]) -> std::result::Result<i32, String> {
    let place = varint(data)?;
    Ok(((place >> 1) as i64 ^ -((place & 1) as i64)) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of 128 in 4 miniblocks, `numbers` of them; the first is `first`, the differences are `least` plus 0.
    fn constant(numbers: u8, first: u8, least: u8) -> Vec<u8> {
        [&[0x80, 1, 4, numbers, 2 * first][..], if numbers > 1 { &[0, 0, 0, 0, 0] } else { &[] }]
            .concat()
            .into_iter()
            .enumerate()
            .map(|(i, byte)| if i == 5 { 2 * least } else { byte })
            .collect()
    }

    fn values(encoding: Encoding, data: &[u8], count: u32) -> std::result::Result<Vec<String>, String> {
        let mut plain = Vec::new();
        unpack(encoding, data, count, &mut plain)?;
        let (mut rest, mut all) = (&plain[..], Vec::new());
        while let Some((length, behind)) = rest.split_first_chunk() {
            let (text, behind) = behind.split_at(u32::from_le_bytes(*length) as usize);
            all.push(String::from_utf8(text.to_vec()).expect("text"));
            rest = behind;
        }
        Ok(all)
    }

    /// The examples of the format's description (Encodings.md).
    #[test]
    fn texts_are_those_of_the_format() {
        // Lengths 5, 5, 6, 6: least difference 0, differences 0, 1, 0 of one bit.
        let lengths = [&[0x80, 1, 4, 4, 10, 0, 1, 0, 0, 0, 0b010, 0, 0, 0][..], b"HelloWorldFoobarABCDEF"].concat();
        let expected = ["Hello", "World", "Foobar", "ABCDEF"].map(str::to_owned).to_vec();
        assert_eq!(values(Encoding::DELTA_LENGTH_BYTE_ARRAY, &lengths, 4), Ok(expected));
        // axis, axle, babble, babyhood: shared 0, 2, 0, 3, others 4, 2, 6, 5; differences 2, -2, 3 and -2, 4, -1.
        let shared = [0x80, 1, 4, 4, 0, 3, 3, 0, 0, 0, 0b0100_0100, 0b1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let others = [0x80, 1, 4, 4, 8, 3, 3, 0, 0, 0, 0b0111_0000, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let whole = [&shared[..], &others, b"axislebabbleyhood"].concat();
        let expected = ["axis", "axle", "babble", "babyhood"].map(str::to_owned).to_vec();
        assert_eq!(values(Encoding::DELTA_BYTE_ARRAY, &whole, 4), Ok(expected));
        for end in 0..whole.len() {
            assert!(values(Encoding::DELTA_BYTE_ARRAY, &whole[..end], 4).is_err(), "{end}");
        }
    }

    #[test]
    fn lengths_are_not_believed() {
        let delta = |data: &[u8]| values(Encoding::DELTA_LENGTH_BYTE_ARRAY, data, 100).expect_err("it is invalid");
        // More numbers than the page has values; a text of 60 bytes out of 2; a length of -1; one of 33 bits.
        assert_eq!(delta(&constant(101, 0, 0)), LENGTHS);
        assert_eq!(delta(&[&constant(1, 60, 0)[..], b"ab"].concat()), SHORT);
        assert_eq!(delta(&[0x80, 1, 4, 1, 1]), LENGTHS);
        assert!(delta(&[0x80, 1, 4, 2, 0, 0, 33, 0, 0, 0]).contains("33 bits"));
        // No miniblocks, some of 7 numbers, and some that take more than memory.
        for shape in [&[0x80, 1, 0][..], &[28, 4], &[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 1, 4]] {
            assert!(delta(&[shape, &[4, 0, 0, 0, 0, 0, 0]].concat()).contains("blocks"));
        }
        // The second value shares 3 bytes with the first one, which has 2.
        let shared = constant(2, 0, 3);
        let whole = [&shared[..], &constant(2, 2, 0), b"abcd"].concat();
        assert_eq!(values(Encoding::DELTA_BYTE_ARRAY, &whole, 2), Err(LENGTHS.to_owned()));
    }

    /// Each value repeats the one before and adds a byte: a page of some kilobytes would take gigabytes.
    #[test]
    fn a_page_that_grows_without_end_is_refused() {
        let count = 60_000_u32;
        let numbers = |first: u8, least: u8| {
            let mut data = vec![0x80, 0x80, 4, 1];
            data.extend([(count & 127) as u8 | 128, (count >> 7 & 127) as u8 | 128, (count >> 14) as u8, 2 * first]);
            data.extend([2 * least, 0]);
            data
        };
        let whole = [numbers(0, 1), numbers(1, 0), vec![b'a'; count as usize]].concat();
        let said = values(Encoding::DELTA_BYTE_ARRAY, &whole, count).expect_err("too large");
        assert!(said.contains("more than 268435456 bytes of text"), "{said}");
    }
}
