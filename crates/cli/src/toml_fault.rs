//! What a TOML parser refuses, in one line with its place.

/// The parser's message after the line it speaks of.
pub fn fault(text: &str, error: &toml::de::Error) -> String {
    let at = error.span().map_or(0, |span| span.start).min(text.len());
    let line = text[..at].matches('\n').count() + 1;
    format!("line {line}: {}", error.message())
}
