//! Random streams, and where one stands, so that a resumed run goes on with the same numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// The random stream `number` of a seed, at its `round`th part.
pub(super) fn stream(seed: u64, number: u64, round: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    // Far more numbers than one round can use.
    rng.set_word_pos(u128::from(round) << 40);
    rng
}

/// Uniform in [0, 1), from the upper 53 bits.
pub(super) fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// The state of a [`ChaCha8Rng`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RngState {
    pub seed: [u8; 32],
    pub stream: u64,
    pub word_pos: u128,
}

impl RngState {
    pub fn of(rng: &ChaCha8Rng) -> Self {
        Self {
            seed: rng.get_seed(),
            stream: rng.get_stream(),
            word_pos: rng.get_word_pos(),
        }
    }

    pub fn restore(&self) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::from_seed(self.seed);
        rng.set_stream(self.stream);
        rng.set_word_pos(self.word_pos);
        rng
    }

    /// Seed (four words, little-endian), stream, word position (low, high).
    pub(crate) fn to_words(self) -> [u64; 7] {
        let mut words = [0; 7];
        for (word, bytes) in words.iter_mut().zip(self.seed.chunks_exact(8)) {
            *word = bytes
                .iter()
                .rev()
                .fold(0, |word, &byte| word << 8 | u64::from(byte));
        }
        words[4] = self.stream;
        words[5] = self.word_pos as u64;
        words[6] = (self.word_pos >> 64) as u64;
        words
    }

    pub(crate) fn from_words(words: [u64; 7]) -> Self {
        let mut seed = [0; 32];
        for (bytes, word) in seed.chunks_exact_mut(8).zip(words) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Self {
            seed,
            stream: words[4],
            word_pos: u128::from(words[6]) << 64 | u128::from(words[5]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restored_stream_goes_on_where_it_was() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        rng.set_stream(3);
        for _ in 0..37 {
            rng.next_u32();
        }
        let state = RngState::of(&rng);
        let mut restored = RngState::from_words(state.to_words()).restore();
        for _ in 0..100 {
            assert_eq!(rng.next_u64(), restored.next_u64());
        }
    }
}
