//! Choices that follow from a seed and an input's number alone.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The stream of one input.
pub struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64, input: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(input);
        Self(random)
    }

    pub fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A number below `limit`, or zero where there is none.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.word() % limit.max(1) as u64) as usize
    }

    /// One of `items`, which mustn't be empty.
    pub fn of<'a, T>(&mut self, items: &'a [T]) -> &'a T {
        &items[self.below(items.len())]
    }

    pub fn one_in(&mut self, many: usize) -> bool {
        self.below(many) == 0
    }

    /// Mostly one, seldom many.
    pub fn few(&mut self) -> usize {
        1 + (self.word() | 1 << 5).trailing_zeros() as usize
    }

    /// A part of something `length` long, mostly short.
    pub fn part(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        let most = *self.of(&[8, 64, 512, 4096]);
        start..(start + self.below(most)).min(length)
    }

    /// A number at the edge of what some field may hold.
    pub fn edge(&mut self) -> u64 {
        match self.below(4) {
            0 => self.below(16) as u64,
            1 => 1_u64.wrapping_shl(self.below(64) as u32),
            2 => 1_u64
                .wrapping_shl(self.below(64) as u32)
                .wrapping_sub(self.below(3) as u64),
            _ => u64::MAX - self.below(16) as u64,
        }
    }

    /// A real that arithmetic has trouble with.
    pub fn real(&mut self) -> f64 {
        let edges = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            1e-300,
            1e-12,
            1e9,
            -1e9,
            1e15,
            1e38,
            1e300,
            f64::MIN_POSITIVE,
        ];
        let beyond = [f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        match self.below(3) {
            0 => *self.of(&beyond),
            1 => f64::from_bits(self.word()),
            _ => *self.of(&edges),
        }
    }
}
