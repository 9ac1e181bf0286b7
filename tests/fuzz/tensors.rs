//! Damage inside safetensors files: to the list of tensors, to our own metadata, and to the numbers.

use super::json;
use super::random::Random;
use serde_json::Value;

/// Bytes that say how long the header is.
const LENGTH: usize = 8;

/// A file's parts.
pub struct Tensors {
    header: Value,
    /// Our metadata, which the header holds as a text.
    own: Value,
    body: Vec<u8>,
}

impl Tensors {
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let length = u64::from_le_bytes(*bytes.first_chunk()?) as usize;
        let header: Value = serde_json::from_slice(bytes.get(LENGTH..LENGTH + length)?).ok()?;
        let own = serde_json::from_str(header["__metadata__"]["mimic"].as_str()?).ok()?;
        let body = bytes[LENGTH + length..].to_vec();
        Some(Self { header, own, body })
    }

    pub fn mutated(&self, random: &mut Random) -> Vec<u8> {
        let mut header = self.header.clone();
        let mut body = self.body.clone();
        match random.below(4) {
            0 => super::plain::mutate(&mut body, random),
            1 => numbers(&mut body, random),
            2 => {
                let own = json::mutated(&self.own, random);
                header["__metadata__"]["mimic"] = String::from_utf8_lossy(&own).into();
            }
            _ => return assemble(json::mutated(&header, random), &body, random),
        }
        assemble(header.to_string().into_bytes(), &body, random)
    }
}

/// Puts numbers in the place of others, mostly those of some `f64` or `f32`.
fn numbers(body: &mut [u8], random: &mut Random) {
    for _ in 0..random.few() {
        let width = *random.of(&[4, 8]);
        let at = random.below(body.len() / width) * width;
        let number = match width {
            4 => u64::from((random.real() as f32).to_bits()),
            _ => random.real().to_bits(),
        };
        if let Some(place) = body.get_mut(at..at + width) {
            place.copy_from_slice(&number.to_le_bytes()[..width]);
        }
    }
}

fn assemble(mut header: Vec<u8>, body: &[u8], random: &mut Random) -> Vec<u8> {
    header.resize(header.len().next_multiple_of(8), b' ');
    let length = match random.one_in(16) {
        true => random.edge(),
        false => header.len() as u64,
    };
    [&length.to_le_bytes()[..], &header, body].concat()
}
