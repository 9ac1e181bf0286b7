//! A look at MJCF text before the parser sees it: bounded nesting, and only what a self-contained character uses.

/// Deepest nesting of elements. The parser recurses once per level, and no character comes near this.
const MAX_DEPTH: usize = 100;

/// Elements that read other files or generate bodies; a skeleton has to stand in one text.
const REFUSED: [&str; 6] = [
    "include",
    "attach",
    "frame",
    "replicate",
    "composite",
    "flexcomp",
];

/// Checks `xml`; the error says which element is at fault and what to do.
pub(super) fn check(xml: &str) -> Result<(), String> {
    let mut depth = 0_usize;
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let end = markup_end(rest).ok_or("a tag or comment is not closed")?;
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
            return Err(format!("elements are nested more than {MAX_DEPTH} deep"));
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

fn check_tag(tag: &str) -> Result<(), String> {
    let name = tag[1..]
        .split(|c: char| c.is_whitespace() || c == '/' || c == '>')
        .next()
        .unwrap_or_default();
    if REFUSED.contains(&name) {
        return Err(format!(
            "<{name}> is not supported: write its content out (MuJoCo's mj_saveLastXML does this)"
        ));
    }
    if name == "compiler" && !euler_sequence_is_valid(tag) {
        return Err("<compiler eulerseq> needs three letters out of x, y, z, X, Y, Z".into());
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
