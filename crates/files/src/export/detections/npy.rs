//! Arrays for NumPy in the `.npy` format, version 1.0.

/// The first bytes of a file.
pub const MAGIC: &[u8] = b"\x93NUMPY";

/// Returns the bytes of an array of float32 with shape (rows, columns), little-endian, row by row; `values`
/// must yield rows · columns numbers.
pub fn float32(rows: usize, columns: usize, values: impl Iterator<Item = f32>) -> Vec<u8> {
    array("<f4", &format!("({rows}, {columns})"), values.flat_map(f32::to_le_bytes))
}

/// Returns the bytes of an array of float64 with shape (rows, columns), like [`float32`].
pub fn float64(rows: usize, columns: usize, values: impl Iterator<Item = f64>) -> Vec<u8> {
    array("<f8", &format!("({rows}, {columns})"), values.flat_map(f64::to_le_bytes))
}

/// Returns the bytes of a one-dimensional array of texts.
pub fn texts(texts: &[&str]) -> Vec<u8> {
    let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let padded = texts.iter().flat_map(|text| {
        let codes = text.chars().map(u32::from);
        codes.chain(std::iter::repeat(0)).take(longest)
    });
    let bytes = padded.flat_map(u32::to_le_bytes);
    array(&format!("<U{longest}"), &format!("({},)", texts.len()), bytes)
}

fn array(kind: &str, shape: &str, values: impl Iterator<Item = u8>) -> Vec<u8> {
    /// Alignment of the data, bytes.
    const ALIGNED: usize = 64;
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let before = MAGIC.len() + 4;
    // A line end closes the header.
    let blanks = (ALIGNED - (before + head.len() + 1) % ALIGNED) % ALIGNED;
    head.extend(std::iter::repeat_n(' ', blanks));
    head.push('\n');
    let mut bytes = [MAGIC, &[1, 0], &(head.len() as u16).to_le_bytes(), head.as_bytes()].concat();
    bytes.extend(values);
    bytes
}
