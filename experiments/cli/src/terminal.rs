//! Text for a terminal. Everything that the program prints goes through here, so that a name in a file cannot move the
//! cursor, change colours or hide what is printed.

use std::borrow::Cow;
use std::fmt::Write as _;

/// `text` with every character that a terminal would act on written out, as in `\u{1b}`. Line ends and tabs stay.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        if acts(character) {
            // writing to a string cannot fail
            let _ = write!(out, "{}", character.escape_unicode());
        } else {
            out.push(character);
        }
    }
    Cow::Owned(out)
}

/// Whether a terminal acts on the character in place of showing it: control characters, and those that turn the
/// direction of the text.
fn acts(character: char) -> bool {
    let layout = matches!(character, '\n' | '\t');
    let turns = matches!(character, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (character.is_control() && !layout) || turns
}

/// `text` on one line, whatever a library or a file put into it.
pub(crate) fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_act_on_is_written_out() {
        for (text, shown) in [
            ("T\tµS ± 0.1\n× 10²", "T\tµS ± 0.1\n× 10²"),
            ("a\u{1b}[31mb", "a\\u{1b}[31mb"),
            ("a\r\u{7}\u{8}\u{7f}", "a\\u{d}\\u{7}\\u{8}\\u{7f}"),
            ("\u{9b}2J", "\\u{9b}2J"),
            ("\u{202e}txt.exe", "\\u{202e}txt.exe"),
        ] {
            assert_eq!(plain(text), shown);
        }
    }

    #[test]
    fn one_line_is_one_line() {
        assert_eq!(one_line("\n a \n\n  b\r\nc"), "a; b; c");
    }
}
