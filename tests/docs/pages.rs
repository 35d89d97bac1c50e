//! Pages of Markdown: their fenced blocks and their inline code.

use std::fs;
use std::path::{Path, PathBuf};

/// A fenced block.
pub(super) struct Block {
    /// First line of its text.
    pub(super) line: usize,
    pub(super) language: String,
    pub(super) text: String,
    /// The HTML comment before it, without its arrows.
    comment: String,
}

impl Block {
    /// What `<!-- name: VALUE -->` before the block says.
    pub(super) fn mark(&self, name: &str) -> Option<&str> {
        self.comment.strip_prefix(name)?.strip_prefix(": ")
    }
}

/// The folder of the project.
pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// README.md, the book's chapters, and the other pages with commands.
pub(super) fn pages() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("docs")).expect("the folder can be listed");
    let mut pages: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be listed").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .collect();
    let others = [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "firmware/cell/README.md",
        "examples/README.md",
    ];
    pages.extend(others.iter().map(|name| root().join(name)).filter(|path| path.exists()));
    pages.sort();
    assert!(pages.len() > 12, "{pages:?}");
    pages
}

/// The fenced blocks of a page.
pub(super) fn blocks(page: &Path) -> Vec<Block> {
    let text = fs::read_to_string(page).expect("the page can be read");
    let mut found = Vec::new();
    let mut lines = text.lines().enumerate();
    let mut before = "";
    while let Some((number, line)) = lines.next() {
        let Some(language) = line.trim_start().strip_prefix("```") else {
            before = line;
            continue;
        };
        let body = lines.by_ref().map(|(_, line)| line).take_while(|line| line.trim() != "```");
        let text: String = body.flat_map(|line| [line, "\n"]).collect();
        let comment = before.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->"));
        found.push(Block {
            line: number + 2,
            language: language.split(',').next().unwrap_or_default().to_owned(),
            text,
            comment: comment.unwrap_or_default().to_owned(),
        });
        before = "";
    }
    found
}

/// The code within a page's sentences and tables.
pub(super) fn inline_code(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).expect("the page can be read");
    let mut fenced = false;
    let mut found = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            let pieces = line.split('`').skip(1).step_by(2);
            found.extend(pieces.map(|code| code.replace("\\|", "|")));
        }
    }
    found
}
