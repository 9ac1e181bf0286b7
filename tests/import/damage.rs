//! Damage to files, the same in every run.

/// A small linear congruential generator (Knuth's MMIX constants), so that every run sees the same damage.
pub(crate) struct Damage(u64);

impl Damage {
    pub(crate) fn new() -> Self {
        Self(0x6d_696d_6963)
    }

    fn below(&mut self, limit: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit.max(1)
    }

    /// Cuts the end off, flips bits, puts a wrong length or part over others, doubles a part, or changes digits.
    ///
    /// Lengths and digits go into the first `head` bytes.
    pub(crate) fn apply(&mut self, bytes: &mut Vec<u8>, head: usize) {
        match self.below(6) {
            0 => bytes.truncate(self.below(bytes.len())),
            1 => {
                for _ in 0..=self.below(8) {
                    let at = self.below(bytes.len());
                    bytes[at] ^= 1 << self.below(8);
                }
            }
            2 => {
                let at = self.below(bytes.len().min(head));
                let lengths = [0, 1, 0x7fff_ffff, 0xffff_ffff, 0x10_0000, 1 << 40, u64::MAX];
                let length: [u8; 8] = u64::to_le_bytes(lengths[self.below(lengths.len())]);
                let end = (at + [1, 4, 8][self.below(3)]).min(bytes.len());
                bytes[at..end].copy_from_slice(&length[..end - at]);
            }
            3 => {
                let (from, to) = (self.part(bytes), self.below(bytes.len()));
                let part = bytes[from].to_vec();
                let end = (to + part.len()).min(bytes.len());
                bytes[to..end].copy_from_slice(&part[..end - to]);
            }
            4 => {
                let (from, to) = (self.part(bytes), self.below(bytes.len()));
                let part = bytes[from].to_vec();
                bytes.splice(to..to, part);
            }
            _ => {
                // A digit of a text, so that the JSON stays whole and its numbers go wrong.
                let digits: Vec<usize> = (0..bytes.len().min(head))
                    .filter(|&at| bytes[at].is_ascii_digit())
                    .collect();
                for _ in 0..=self.below(3) {
                    if let Some(&at) = digits.get(self.below(digits.len())) {
                        bytes[at] = b"0123456789"[self.below(10)];
                    }
                }
            }
        }
    }

    fn part(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let start = self.below(bytes.len());
        start..(start + self.below(2000)).min(bytes.len())
    }
}
