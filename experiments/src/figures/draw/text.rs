//! Width, wrapping and escaping of text.

/// Advance of a character of DejaVu Sans in em, within about 10 %. Wider than the usual sans-serif faces, so a text
/// that fits by this measure fits in any of them.
fn advance_em(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '\'' | '|' => 0.29,
        ' ' | '.' | ',' | ':' | ';' | '!' | 'I' | 'f' | 't' | '(' | ')' | '[' | ']' | '/' | '·' => 0.37,
        'r' | '"' | '-' => 0.42,
        's' | 'z' | 'c' | 'v' | 'x' | 'y' | 'k' => 0.57,
        'm' | 'W' | '%' | '@' => 0.98,
        'M' | 'w' | '–' | '±' | '×' | '=' | '<' | '>' | '≥' | '≤' | '+' => 0.85,
        c if c.is_ascii_uppercase() => 0.71,
        c if c.is_ascii() => 0.64,
        _ => 0.72,
    }
}

/// Width of a text in the unit of `size`, the em.
#[must_use]
pub fn text_width(text: &str, size: f64, bold: bool) -> f64 {
    text.chars().map(advance_em).sum::<f64>() * size * if bold { 1.12 } else { 1.0 }
}

/// Breaks a text between words into lines no wider than `width`; a longer word keeps a line of its own.
#[must_use]
pub fn wrap(text: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        let longer = if line.is_empty() {
            word.to_owned()
        } else {
            format!("{line} {word}")
        };
        if !line.is_empty() && text_width(&longer, size, bold) > width {
            lines.push(std::mem::replace(&mut line, word.to_owned()));
        } else {
            line = longer;
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// Text for XML and HTML, in content and in quoted attributes. Characters that XML forbids are dropped.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(c),
            '\u{fffe}' | '\u{ffff}' => {}
            c if c < ' ' => {}
            c => out.push(c),
        }
    }
    out
}
