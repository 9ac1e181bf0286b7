//! The tags of an XML text and their attributes, as they stand there. Whether they are XML is for the parser to say.

/// A tag that opens an element.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tag<'a> {
    /// Name of the element.
    pub name: &'a str,
    /// What stands between the name and the tag's end.
    attributes: &'a str,
    /// Whether the element ends with its tag.
    pub is_empty: bool,
}

/// One piece of markup.
#[derive(Clone, Copy, Debug)]
pub(super) enum Markup<'a> {
    Open(Tag<'a>),
    Close,
    /// A section of plain text, which MJCF has no use for.
    Cdata,
    /// A comment or an instruction.
    Other,
    /// Markup that the text ends in.
    Unclosed,
}

/// All markup of a text.
pub(super) fn markup(mut text: &str) -> impl Iterator<Item = Markup<'_>> {
    std::iter::from_fn(move || {
        text = &text[text.find('<')?..];
        let Some(end) = end_of(text) else {
            text = "";
            return Some(Markup::Unclosed);
        };
        let (piece, rest) = text.split_at(end);
        text = rest;
        Some(kind(piece))
    })
}

fn kind(piece: &str) -> Markup<'_> {
    if piece.starts_with("</") {
        return Markup::Close;
    }
    if piece.starts_with("<![CDATA[") {
        return Markup::Cdata;
    }
    if piece.starts_with("<!") || piece.starts_with("<?") {
        return Markup::Other;
    }
    let inner = piece[1..].strip_suffix('>').unwrap_or_default();
    let (inner, is_empty) = match inner.strip_suffix('/') {
        Some(inner) => (inner, true),
        None => (inner, false),
    };
    let end = inner.find(char::is_whitespace).unwrap_or(inner.len());
    let (name, attributes) = inner.split_at(end);
    Markup::Open(Tag {
        name,
        attributes,
        is_empty,
    })
}

/// Length of the markup that `text` begins with.
fn end_of(text: &str) -> Option<usize> {
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

impl<'a> Tag<'a> {
    /// Names and values of the attributes, up to the first that is broken.
    pub fn attributes(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let mut rest = self.attributes;
        std::iter::from_fn(move || {
            let (name, after) = rest.split_once('=')?;
            let after = after.trim_start();
            let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, after) = after[1..].split_once(quote)?;
            rest = after;
            Some((name.trim(), value))
        })
    }

    /// The value of an attribute.
    pub fn attribute(&self, wanted: &str) -> Option<&'a str> {
        let mut attributes = self.attributes();
        let found = attributes.find(|(name, _)| *name == wanted);
        found.map(|(_, value)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_attributes_are_found_as_they_stand() {
        let text =
            r#"text <!-- <no a="1"> --> <a/><b c = "1 > 2" d='"'> e </b><?f <g>?><h x="1" y><"#;
        let found: Vec<String> = markup(text)
            .map(|markup| match markup {
                Markup::Open(tag) => {
                    let attributes: Vec<_> = tag.attributes().collect();
                    format!("{} {} {attributes:?}", tag.name, tag.is_empty)
                }
                other => format!("{other:?}"),
            })
            .collect();
        let expected = [
            "Other",
            "a true []",
            r#"b false [("c", "1 > 2"), ("d", "\"")]"#,
            "Close",
            "Other",
            r#"h false [("x", "1")]"#,
            "Unclosed",
        ];
        assert_eq!(found, expected);
    }
}
