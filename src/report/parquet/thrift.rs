//! The little of Thrift's compact protocol that a Parquet footer needs.
//! <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>

// Types of fields and list elements.
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A struct under construction; fields are added with increasing ids.
#[derive(Debug, Default)]
pub struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

impl Struct {
    pub fn new() -> Struct {
        Struct::default()
    }

    fn field(&mut self, id: u8, kind: u8) {
        debug_assert!(id > self.last && id - self.last < 16, "ids increase by less than 16");
        self.bytes.push((id - self.last) << 4 | kind);
        self.last = id;
    }

    pub fn i32(&mut self, id: u8, value: i64) {
        self.field(id, I32);
        self.bytes.extend(zigzag(value));
    }

    pub fn i64(&mut self, id: u8, value: i64) {
        self.field(id, I64);
        self.bytes.extend(zigzag(value));
    }

    pub fn string(&mut self, id: u8, text: &str) {
        self.field(id, BINARY);
        self.bytes.extend(binary(text));
    }

    pub fn structure(&mut self, id: u8, content: Struct) {
        self.field(id, STRUCT);
        self.bytes.extend(content.finish());
    }

    pub fn structs(&mut self, id: u8, items: Vec<Struct>) {
        self.list(id, STRUCT, items.into_iter().map(Struct::finish).collect());
    }

    pub fn strings(&mut self, id: u8, items: &[&str]) {
        self.list(id, BINARY, items.iter().map(|text| binary(text)).collect());
    }

    pub fn i32s(&mut self, id: u8, items: &[i64]) {
        self.list(id, I32, items.iter().map(|value| zigzag(*value)).collect());
    }

    fn list(&mut self, id: u8, kind: u8, items: Vec<Vec<u8>>) {
        self.field(id, LIST);
        if items.len() < 15 {
            self.bytes.push((items.len() as u8) << 4 | kind);
        } else {
            self.bytes.push(0xf0 | kind);
            self.bytes.extend(varint(items.len() as u64));
        }
        items.into_iter().for_each(|item| self.bytes.extend(item));
    }

    /// The bytes, with the mark of the end.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }
}

fn binary(text: &str) -> Vec<u8> {
    let mut bytes = varint(text.len() as u64);
    bytes.extend(text.as_bytes());
    bytes
}

/// Small magnitudes of either sign become small numbers.
fn zigzag(value: i64) -> Vec<u8> {
    varint((value << 1 ^ value >> 63) as u64)
}

/// Seven bits to a byte, the lowest first.
pub fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}
