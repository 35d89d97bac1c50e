//! Width, wrapping and escaping of text.

/// Height of a capital above the base line, halved, in em: moves the anchor from the middle to the base line.
pub(super) const HALF_CAPITAL_EM: f64 = 0.36;

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

/// Breaks a text between words into lines no wider than `width`; a longer word keeps a line of its own. A number
/// stays with its unit, and a relation with both of its sides.
#[must_use]
pub fn wrap(text: &str, size: f64, bold: bool, width: f64) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in phrases(text) {
        let longer = if line.is_empty() {
            word.clone()
        } else {
            format!("{line} {word}")
        };
        if !line.is_empty() && text_width(&longer, size, bold) > width {
            lines.push(std::mem::replace(&mut line, word));
        } else {
            line = longer;
        }
    }
    if !line.is_empty() {
        lines.push(line);
    }
    lines
}

/// Words, and groups of words that belong on one line.
fn phrases(text: &str) -> Vec<String> {
    /// Longest word after a number that is taken for its unit, in characters.
    const UNIT_LENGTH: usize = 3;
    let relation = |word: &str| matches!(word, "=" | "<" | ">" | "≤" | "≥" | "≈" | "±" | "×" | "·");
    let mut out: Vec<String> = Vec::new();
    let mut last = "";
    for word in text.split_whitespace() {
        let unit = last.ends_with(|c: char| c.is_ascii_digit()) && word.chars().count() <= UNIT_LENGTH;
        let equals = matches!(word, "=" | "±" | "×" | "·");
        match out.last_mut() {
            Some(phrase) if unit || equals || relation(last) => {
                phrase.push(' ');
                phrase.push_str(word);
            }
            _ => out.push(word.to_owned()),
        }
        last = word;
    }
    out
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

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn lines_break_between_phrases() {
        let lines = wrap("paper: ≥ 98 % at M = 20", 10.0, false, 1.0);
        assert_eq!(lines, ["paper:", "≥ 98 %", "at", "M = 20"]);
        assert_eq!(wrap("one line", 10.0, false, 1e3), ["one line"]);
        assert!(wrap("  ", 10.0, false, 1.0).is_empty());
    }
}
