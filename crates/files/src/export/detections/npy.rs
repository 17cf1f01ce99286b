//! Arrays for NumPy in the `.npy` format, version 1.0.

/// The first bytes of a file.
pub const MAGIC: &[u8] = b"\x93NUMPY";

/// Returns the bytes of an array of float32 with shape (rows, columns), little-endian, row by row; `values`
/// must yield rows · columns numbers.
pub fn float32(rows: usize, columns: usize, values: impl Iterator<Item = f32>) -> Vec<u8> {
    /// Alignment of the data, bytes.
    const ALIGNED: usize = 64;
    let shape = format!("({rows}, {columns})");
    let mut head = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
    let before = MAGIC.len() + 4;
    // A line end closes the header.
    let blanks = (ALIGNED - (before + head.len() + 1) % ALIGNED) % ALIGNED;
    head.extend(std::iter::repeat_n(' ', blanks));
    head.push('\n');
    let mut bytes = [MAGIC, &[1, 0], &(head.len() as u16).to_le_bytes(), head.as_bytes()].concat();
    bytes.extend(values.flat_map(f32::to_le_bytes));
    bytes
}
