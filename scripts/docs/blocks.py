"""The fenced blocks of Markdown pages, and the marks that say how each is checked.

A mark is an HTML comment on the line before a block, which no reader sees:

    <!-- run: slow -->          takes half a minute or more: run with `--with slow` alone
    <!-- run: recordings -->    needs recordings of the real skin: run where they are at hand
    <!-- run: network -->       fetches something: run with `--with network` alone
    <!-- run: hardware -->      needs a device, another machine or a second terminal: never run
    <!-- run: none -->          shows something that is neither run nor compared
    <!-- toml: spec -->         a data set's spec; also `profile`, `part` (of a profile); without a mark a scene

Words may be joined: `<!-- run: slow, recordings -->`. Whatever the mark, a test parses every `spts` line.
"""

import dataclasses
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
LANGUAGES = {"sh", "python", "rust", "toml", "json", "text"}
MARKS = {"slow", "recordings", "network", "hardware", "none"}
KINDS = {"scene", "spec", "profile", "part"}
MARK = re.compile(r"<!-- (run|toml): ([a-z, ]+) -->")


class PageError(Exception):
    """A page that is not written by the rules; says where."""


@dataclasses.dataclass(frozen=True)
class Block:
    """One fenced block of a page."""

    page: pathlib.Path
    line: int
    language: str
    marks: frozenset
    text: str

    @property
    def where(self):
        """Page and line, as editors take them."""
        return f"{self.page}:{self.line}"


def pages():
    """README.md and the chapters of the book, in the order of their names."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]


def blocks(page):
    """The fenced blocks of `page`, in order."""
    found = []
    lines = page.read_text().splitlines()
    number = 0
    while number < len(lines):
        fence = re.match(r"( *)```(.*)$", lines[number])
        number += 1
        if not fence:
            continue
        first = number
        while number < len(lines) and lines[number].strip() != "```":
            number += 1
        if number == len(lines):
            raise PageError(f"{page}:{first}: the block has no end")
        marks = _marks(page, first - 1, lines[first - 2] if first > 1 else "")
        language = fence[2].split(",")[0].strip()
        if language not in LANGUAGES:
            known = ", ".join(sorted(LANGUAGES))
            raise PageError(f"{page}:{first}: `{fence[2]}` is not one of the languages {known}")
        indent = len(fence[1])
        text = "".join(line[indent:] + "\n" for line in lines[first:number])
        found.append(Block(page, first, language, marks, text))
        number += 1
    return found


def _marks(page, number, line):
    """The marks on the line before a block."""
    if not line.startswith("<!-- "):
        return frozenset()
    mark = MARK.fullmatch(line)
    if mark is None:
        raise PageError(f"{page}:{number}: `{line}` is no mark of a block; see scripts/docs/blocks.py")
    words = frozenset(word.strip() for word in mark[2].split(","))
    known = MARKS if mark[1] == "run" else KINDS
    if not words <= known:
        raise PageError(
            f"{page}:{number}: marks are {', '.join(sorted(known))}, and not {', '.join(sorted(words - known))}"
        )
    return words
