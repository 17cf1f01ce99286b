/// The JSON and the binary part of a glTF file.
pub struct Parts {
    pub json: Vec<u8>,
    pub binary: Vec<u8>,
}

impl Parts {
    pub fn of(bytes: &[u8]) -> Self {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        Self { json: bytes[20..20 + length].to_vec(), binary: bytes[28 + length..].to_vec() }
    }

    pub fn join(mut self) -> Vec<u8> {
        self.json.resize(self.json.len().next_multiple_of(4), b' ');
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let word = |n: usize| (n as u32).to_le_bytes();
        let length = 28 + self.json.len() + self.binary.len();
        let head =
            [&b"glTF\x02\0\0\0"[..], &word(length), &word(self.json.len()), b"JSON"].concat();
        [&head[..], &self.json, &word(self.binary.len()), b"BIN\0", &self.binary].concat()
    }
}
