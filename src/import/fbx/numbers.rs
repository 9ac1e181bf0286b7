//! Numbers out of bytes, and whether they can be used.

/// Whether a number of the file is finite, and small enough that sums and products of a few such numbers are finite too.
pub(super) fn in_range(value: f64) -> bool {
    value.abs() < 1e12
}

/// Four bytes, little-endian; missing bytes count as zero.
pub(super) fn word(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .take(4)
        .rev()
        .fold(0, |n, &byte| n << 8 | u32::from(byte))
}

/// Eight bytes, little-endian; missing bytes count as zero.
pub(super) fn double_word(bytes: &[u8]) -> u64 {
    u64::from(word(bytes)) | u64::from(word(bytes.get(4..).unwrap_or(&[]))) << 32
}
