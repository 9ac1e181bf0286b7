//! What all drawings share: the frame of the file, tick marks, and text.

use mimic::explain::plain;

/// Least distance between tick marks, pixels: a line of text needs about half of it.
const TICK_ROOM: f64 = 30.0;

/// Most marks of an axis. A step is chosen for a handful of them, but very large numbers have no next one a step away.
pub const MOST_MARKS: u32 = 50;

/// The step between the tick marks of an axis that shows `range` on a length of `pixels`: 1, 2 or 5 times a power of ten.
pub fn tick_step(range: f64, pixels: f64) -> f64 {
    let least = range * TICK_ROOM / pixels;
    let power = 10f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0]
        .map(|m| m * power)
        .into_iter()
        .find(|step| *step >= least);
    step.unwrap_or(10.0 * power)
}

/// Four decimals at most. Adding 0.0 turns a negative zero into a plain one.
pub fn short(value: f64) -> String {
    format!("{}", (value * 1e4).round() / 1e4 + 0.0)
}

/// Text as it may stand in an SVG file.
pub fn escaped(text: &str) -> String {
    let text = plain(text).replace('&', "&amp;");
    text.replace('<', "&lt;").replace('>', "&gt;")
}

/// A whole SVG file, with its own style sheet and background.
pub fn svg(width: f64, height: f64, body: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height:.0}" width="{width}" height="{height:.0}">
<style>
text {{ font: 12px system-ui, sans-serif; fill: #333 }}
.title {{ font-size: 16px; font-weight: 600 }} .heading {{ font-weight: 600 }}
.tick {{ text-anchor: end; fill: #777 }} .time {{ text-anchor: middle; fill: #777 }}
.line {{ fill: none; stroke-width: 1.6; stroke-linejoin: round }} .raw {{ fill: none; stroke-width: 1; opacity: .22 }}
.grid {{ fill: none; stroke: #e4e4e4 }} .frame {{ fill: none; stroke: #bbb }}
</style>
<rect width="100%" height="100%" fill="#fff"/>
{body}</svg>
"##
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_can_not_end_a_tag_or_break_the_file() {
        assert_eq!(escaped("a<b>&\u{1b}\0c"), "a&lt;b&gt;&amp;  c");
    }

    #[test]
    fn ticks_are_round_and_sparse() {
        assert_eq!(tick_step(4.0, 120.0), 1.0);
        assert_eq!(tick_step(1.0, 120.0), 0.5);
        assert!((tick_step(0.03, 120.0) - 0.01).abs() < 1e-12);
        assert_eq!([short(-0.5), short(-0.0), short(20.0)], ["-0.5", "0", "20"]);
    }
}
