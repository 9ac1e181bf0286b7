//! Random streams. Each follows from the seed, its number and the part of the run, so that a resumed run goes on with the
//! same numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// The random stream `number` of a seed, at its `round`th part.
pub(super) fn stream(seed: u64, number: u64, round: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    // Each part begins 2⁴⁰ words further on, far more than one round can use.
    rng.set_word_pos(u128::from(round) << 40);
    rng
}
