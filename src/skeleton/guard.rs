//! Checks MJCF text before the parser sees it: nesting is bounded, and nothing reads other files or generates bodies.

use super::error::Defect;

/// Deepest nesting of elements that is let through. Chosen: the parser recurses once per level, a thread's usual stack
/// holds 100 levels, and no character comes near that depth.
const MAX_DEPTH: usize = 100;

/// Elements that read other files or generate bodies. A skeleton has to be complete in one text, because runs and policy
/// files carry that text along.
const REFUSED: [&str; 6] = [
    "include",
    "attach",
    "frame",
    "replicate",
    "composite",
    "flexcomp",
];

/// Checks the markup of `xml`. It looks at tags only; whether they are MJCF is for the parser to say.
pub(super) fn check(xml: &str) -> Result<(), Defect> {
    let mut depth = 0_usize;
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let end = markup_end(rest)
            .ok_or_else(|| Defect::new("a tag or comment is not closed", "close it"))?;
        let tag = &rest[..end];
        rest = &rest[end..];
        if tag.starts_with("</") {
            depth = depth.saturating_sub(1);
        } else if !tag.starts_with("<!") && !tag.starts_with("<?") {
            check_tag(tag)?;
            if !tag.ends_with("/>") {
                depth += 1;
            }
        }
        if depth > MAX_DEPTH {
            return Err(Defect::new(
                format!("elements are nested more than {MAX_DEPTH} deep"),
                "remove levels of nesting",
            ));
        }
    }
    Ok(())
}

/// Length of the markup that `text` begins with.
fn markup_end(text: &str) -> Option<usize> {
    for (open, close) in [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")] {
        if let Some(inner) = text.strip_prefix(open) {
            return inner.find(close).map(|at| open.len() + at + close.len());
        }
    }
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(at + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
    }
    None
}

fn check_tag(tag: &str) -> Result<(), Defect> {
    let name = tag[1..]
        .split(|c: char| c.is_whitespace() || c == '/' || c == '>')
        .next()
        .unwrap_or_default();
    if REFUSED.contains(&name) {
        return Err(Defect::new(
            format!("<{name}> is not supported"),
            "save the model with MuJoCo's mj_saveLastXML, which writes all its content out",
        ));
    }
    // The parser panics on a longer sequence and skips letters that it doesn't know.
    if name == "compiler" && !euler_sequence_is_valid(tag) {
        return Err(Defect::new(
            "the `eulerseq` of <compiler> is not three letters out of x, y, z, X, Y, Z",
            "correct it, for example to `xyz`",
        ));
    }
    Ok(())
}

fn euler_sequence_is_valid(tag: &str) -> bool {
    let Some(at) = tag.find("eulerseq") else {
        return true;
    };
    let value: Vec<char> = tag[at..]
        .split(['"', '\''])
        .nth(1)
        .unwrap_or_default()
        .chars()
        .collect();
    value.len() == 3 && value.iter().all(|c| "xyzXYZ".contains(*c))
}
