//! Damage that knows nothing of the format.

use super::random::Random;

pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..random.few() {
        once(bytes, random);
    }
}

fn once(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => flip(bytes, random),
        1 => bytes.truncate(at),
        2 => overwrite(bytes, at, random),
        3 => {
            let part = random.part(bytes.len());
            let part = bytes[part].to_vec();
            bytes.splice(at..at, part);
        }
        4 => {
            let part = random.part(bytes.len());
            let part = bytes[part].to_vec();
            let end = (at + part.len()).min(bytes.len());
            bytes[at..end].copy_from_slice(&part[..end - at]);
        }
        5 => drop(bytes.drain(random.part(bytes.len()))),
        6 => digits(bytes, random),
        _ => {
            let number = random.edge().to_le_bytes();
            bytes.splice(at..at, number[..*random.of(&[1, 2, 4, 8])].iter().copied());
        }
    }
}

fn flip(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..random.few() {
        let at = random.below(bytes.len());
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << random.below(8);
        }
    }
}

/// Puts a number of some width over what is there.
fn overwrite(bytes: &mut [u8], at: usize, random: &mut Random) {
    let number = match random.below(3) {
        0 => random.real().to_bits(),
        1 => u64::from((random.real() as f32).to_bits()),
        _ => random.edge(),
    };
    let end = (at + random.of(&[1, 2, 4, 8])).min(bytes.len());
    bytes[at..end].copy_from_slice(&number.to_le_bytes()[..end - at]);
}

/// Changes digits of a text.
fn digits(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..random.few() {
        let from = random.below(bytes.len());
        let digit = bytes.iter_mut().skip(from).find(|b| b.is_ascii_digit());
        if let Some(digit) = digit {
            *digit = *random.of(b"0123456789-.eE");
        }
    }
}
