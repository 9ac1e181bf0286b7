//! Damage inside the chunks of GLB files, which stay whole themselves: so the damage gets past the reader of the container.

use super::json;
use super::random::Random;
use serde_json::Value;

/// The two chunks of a GLB file.
pub struct Glb {
    json: Value,
    text: Vec<u8>,
    bin: Vec<u8>,
}

impl Glb {
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| {
            let word = bytes.get(at..)?.first_chunk()?;
            Some(u32::from_le_bytes(*word) as usize)
        };
        let length = word(12)?;
        let text = bytes.get(20..20 + length)?.to_vec();
        let bin = bytes.get(28 + length..).unwrap_or_default().to_vec();
        let json = serde_json::from_slice(&text).ok()?;
        Some(Self { json, text, bin })
    }

    pub fn mutated(&self, random: &mut Random) -> Vec<u8> {
        let (mut text, mut bin) = (self.text.clone(), self.bin.clone());
        let both = random.one_in(8);
        let of_text = random.below(4) > 0;
        if of_text || both {
            text = json::mutated(&self.json, random);
        }
        if !of_text || both {
            super::plain::mutate(&mut bin, random);
        }
        assemble(text, bin)
    }
}

fn assemble(mut text: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let chunk = |kind: &[u8], content: Vec<u8>| {
        let length = (content.len() as u32).to_le_bytes();
        [&length[..], kind, &content].concat()
    };
    let chunks = [chunk(b"JSON", text), chunk(b"BIN\0", bin)].concat();
    let length = (12 + chunks.len() as u32).to_le_bytes();
    [&b"glTF\x02\0\0\0"[..], &length, &chunks].concat()
}
