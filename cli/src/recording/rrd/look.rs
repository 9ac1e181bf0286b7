//! Colours, by which the characters and the curves are told apart.

use crate::recording::content::Side;
use rerun::Color;

/// Red, green, blue and opacity, 0 to 255.
pub type Rgba = [u8; 4];

pub const BACKGROUND: Rgba = [24, 26, 31, 255];
pub const GRID: Rgba = [255, 255, 255, 12];
pub const PHASE: Rgba = [190, 196, 206, 255];
pub const AGENT: Rgba = [255, 183, 77, 255];
pub const REFERENCE: Rgba = [129, 199, 245, 255];
pub const SHOVE: Rgba = [235, 87, 87, 255];
pub const TRAIL: Rgba = [129, 199, 245, 120];

/// Colours that people with red-green colour blindness can tell apart too (after Okabe and Ito, lightened for a dark
/// background).
const CURVES: [Rgba; 8] = [
    [86, 180, 233, 255],
    [230, 159, 0, 255],
    [0, 178, 137, 255],
    [240, 228, 66, 255],
    [204, 121, 167, 255],
    [213, 94, 0, 255],
    [148, 156, 245, 255],
    [170, 176, 186, 255],
];

/// Colour of a solid character: warm on its right, cool on its left.
pub fn solid(side: Side) -> Rgba {
    match side {
        Side::Left => [66, 135, 210, 255],
        Side::Middle => [206, 210, 218, 255],
        Side::Right => [232, 138, 56, 255],
    }
}

/// Colour of a transparent character.
pub fn ghost(side: Side) -> Rgba {
    let [r, g, b, _] = solid(side);
    let paler = |c: u8| c / 2 + 110;
    [paler(r), paler(g), paler(b), 70]
}

/// Colour of curve number `index`.
pub fn curve(index: usize) -> Rgba {
    CURVES[index % CURVES.len()]
}

/// Colour of what belongs to one character.
pub fn of_actor(actor: &str) -> Rgba {
    if actor == "agent" { AGENT } else { REFERENCE }
}

/// The same for the SDK.
pub fn color([r, g, b, a]: Rgba) -> Color {
    Color::from_unmultiplied_rgba(r, g, b, a)
}
