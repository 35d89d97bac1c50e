//! The page as HTML: text, headline numbers, figures and tables, without scripts or anything from a network.

use spts_eval::{Table, TextTable, escape};

/// Style of the page, light and dark, screen and print.
const STYLE: &str = include_str!("style.css");
/// Most rows of a table that is not folded away; print shows all rows of any.
const MOST_UNFOLDED: usize = 40;

/// The whole report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Page {
    /// Heading.
    pub title: String,
    /// What the page is and what came out, plain text; blank lines separate paragraphs.
    pub summary: String,
    /// Headline numbers.
    pub cards: Vec<Card>,
    /// Sections, in order.
    pub sections: Vec<Section>,
    /// Terms and what they mean.
    pub glossary: Vec<(String, String)>,
    /// How the page was made: name and value.
    pub provenance: Vec<(String, String)>,
}

/// One headline number.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Card {
    /// Quantity.
    pub label: String,
    /// Whose value it is.
    pub of: String,
    /// Value, with its unit.
    pub value: String,
    /// What the value is held against: whose, and the value.
    pub others: Vec<(String, String)>,
    /// Condition or remark.
    pub note: String,
}

/// One section.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Section {
    /// Anchor, unique on the page.
    pub id: String,
    /// Heading.
    pub title: String,
    /// One or two sentences, plain text.
    pub lead: String,
    /// Figures.
    pub figures: Vec<PageFigure>,
    /// Tables.
    pub tables: Vec<PageTable>,
}

/// One figure of a section.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PageFigure {
    /// Stem of the file in `figures/`. The SVG is shown, with `.png` the PNG, and both are linked. A name that ends in
    /// `.gif` is an animation.
    pub file: String,
    /// File in `figures/` that stands for an animation in print, and for readers who want nothing to move.
    pub still: Option<String>,
    /// What is to be seen, for those who cannot see it.
    pub alt: String,
    /// What it means.
    pub caption: String,
}

impl PageFigure {
    /// The figure in `file`, with what is to be seen and what it means.
    pub fn new(file: impl Into<String>, alt: impl Into<String>, caption: impl Into<String>) -> Self {
        Self { file: file.into(), still: None, alt: alt.into(), caption: caption.into() }
    }

    fn html(&self) -> String {
        let (alt, caption) = (escape(&self.alt), escape(&self.caption));
        let stem = link(self.file.trim_end_matches(".png"));
        let (kind, shown, source, before) = if self.file.ends_with(".gif") {
            ("picture", stem.clone(), format!("figures/{stem}\""), self.standing())
        } else if self.file.ends_with(".png") {
            let source = format!("figures/{stem}.png\"");
            ("picture", format!("{stem}.png"), source, String::new())
        } else {
            ("chart", format!("{stem}.svg"), format!("figures/{stem}.svg\""), String::new())
        };
        let image = format!("<picture>{before}<img src=\"{source} alt=\"{alt}\"></picture>");
        let files = if self.file.ends_with(".gif") {
            format!("<a href=\"figures/{stem}\">GIF</a>")
        } else {
            format!("<a href=\"figures/{stem}.svg\">SVG</a> <a href=\"figures/{stem}.png\">PNG</a>")
        };
        format!(
            "<figure>\n<div class=\"plate {kind}\"><a href=\"figures/{shown}\">{image}</a></div>\n\
             <figcaption>{caption} <span class=\"files\">{files}</span></figcaption>\n</figure>\n"
        )
    }

    /// The picture in place of an animation.
    fn standing(&self) -> String {
        let still = self.still.as_deref();
        still.map_or_else(String::new, |file| {
            format!("<source media=\"print, (prefers-reduced-motion: reduce)\" srcset=\"figures/{}\">", link(file))
        })
    }
}

/// One table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PageTable {
    /// Caption.
    pub caption: String,
    /// What it shows.
    pub table: TextTable,
    /// Files in `tables/` that hold the rows, with or without `.csv`.
    pub files: Vec<String>,
}

impl PageTable {
    /// The columns for readers of `table`, whose rows are in the file `file`.
    pub fn new<R: Copy>(caption: &str, table: &Table<'_, R>, file: &str) -> Self {
        Self { caption: caption.to_owned(), table: table.for_readers(), files: vec![file.to_owned()] }
    }
}

/// The page as one HTML document; `figures/` and `tables/` are looked for beside it.
pub fn html(page: &Page) -> String {
    let title = escape(&page.title);
    let entry = |id: &str, title: &str| format!("<li><a href=\"#{}\">{}</a></li>\n", anchor(id), escape(title));
    let mut contents: String = page.sections.iter().map(|s| entry(&s.id, &s.title)).collect();
    let last = [(&page.glossary, "glossary", "Glossary"), (&page.provenance, "provenance", "Provenance")];
    let mut terms = String::new();
    for (list, id, title) in last.iter().filter(|(list, ..)| !list.is_empty()) {
        contents.push_str(&entry(id, title));
        terms.push_str(&definitions(id, title, list));
    }
    let cards: String = page.cards.iter().map(card).collect();
    let sections: String = page.sections.iter().map(section).collect();
    let nav = wrapped(&contents, "<nav aria-label=\"Contents\"><ol>\n", "</ol></nav>\n");
    let cards = wrapped(
        &cards,
        "<section id=\"main-figures\">\n<h2>The main figures</h2>\n<div class=\"cards\">\n",
        "</div>\n</section>\n",
    );
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n<style>\n{STYLE}</style>\n\
         </head>\n<body>\n<header>\n<h1>{title}</h1>\n{}</header>\n{nav}<main>\n{cards}{sections}{terms}</main>\n\
         </body>\n</html>\n",
        paragraphs(&page.summary, "summary")
    )
}

/// A section of terms and what they are.
fn definitions(id: &str, title: &str, list: &[(String, String)]) -> String {
    let rows = list.iter().map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>\n", escape(name), escape(value)));
    format!(
        "<section id=\"{id}\" class=\"terms\"><h2>{title}</h2>\n<dl>\n{}</dl>\n</section>\n",
        rows.collect::<String>()
    )
}

/// `content` between two tags, or nothing.
fn wrapped(content: &str, before: &str, after: &str) -> String {
    if content.is_empty() { String::new() } else { format!("{before}{content}{after}") }
}

/// Text as paragraphs; what stands between back quotes is code.
fn paragraphs(text: &str, class: &str) -> String {
    text.split("\n\n")
        .filter(|part| !part.trim().is_empty())
        .map(|part| format!("<p class=\"{class}\">{}</p>\n", with_code(&escape(part.trim()))))
        .collect()
}

/// Every second piece between back quotes as code; a back quote without its partner stays.
fn with_code(text: &str) -> String {
    let pieces: Vec<&str> = text.split('`').collect();
    if pieces.len().is_multiple_of(2) {
        return text.to_owned();
    }
    let each = pieces
        .iter()
        .enumerate()
        .map(|(index, piece)| if index % 2 == 1 { format!("<code>{piece}</code>") } else { (*piece).to_owned() });
    each.collect()
}

/// Letters, digits, `-` and `_`; anything else becomes `-`.
fn anchor(id: &str) -> String {
    id.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' }).collect()
}

fn card(card: &Card) -> String {
    let others = card.others.iter();
    let others: String =
        others.map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value))).collect();
    // a number stays with its M
    let title = escape(&card.label).replace(" = ", "\u{a0}=\u{a0}");
    format!(
        "<article class=\"card\"><h3>{}</h3><p class=\"value\"><span>{}</span> {}</p>{}{}</article>\n",
        title,
        escape(&card.of),
        escape(&card.value),
        wrapped(&others, "<dl>", "</dl>"),
        wrapped(&escape(&card.note), "<p class=\"note\">", "</p>"),
    )
}

fn section(section: &Section) -> String {
    let figures: String = section.figures.iter().map(PageFigure::html).collect();
    let tables: String = section.tables.iter().map(table).collect();
    format!(
        "<section id=\"{}\">\n<h2>{}</h2>\n{}{figures}{tables}</section>\n",
        anchor(&section.id),
        escape(&section.title),
        paragraphs(&section.lead, "lead")
    )
}

/// A file name for a link: bytes outside the unreserved set of RFC 3986 are percent-encoded, slashes kept.
fn link(name: &str) -> String {
    name.bytes()
        .map(|byte| match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => char::from(byte).to_string(),
            _ => format!("%{byte:02X}"),
        })
        .collect()
}

fn table(table: &PageTable) -> String {
    // one file needs no name, several do
    let files = table.files.iter().map(|file| {
        let stem = file.strip_suffix(".csv").unwrap_or(file);
        let words =
            if table.files.len() > 1 { escape(&format!("CSV: {}", stem.replace('_', " "))) } else { "CSV".to_owned() };
        format!(" <span class=\"files\"><a href=\"tables/{}.csv\">{words}</a></span>", link(stem))
    });
    let files: String = files.collect();
    let whole = format!("<div class=\"scroll\" tabindex=\"0\">{}</div>\n", table.table.html());
    let count = table.table.rows.len();
    let shown = if count > MOST_UNFOLDED {
        format!("<details>\n<summary>All {count} rows</summary>\n{whole}</details>\n")
    } else {
        whole
    };
    let caption = escape(&table.caption);
    format!("<figure class=\"table\">\n<figcaption>{caption}{files}</figcaption>\n{shown}</figure>\n")
}

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
