"""Checks the links of README.md and of the pages that people read: files, anchors and pictures are there.

`python scripts/docs/links.py`. Addresses on the web are looked at, not fetched.
"""

import re
import sys
import urllib.parse

from blocks import ROOT, pages

LINK = re.compile(r"!?\[[^\]\n]*\]\(([^)\s]+)\)|<img [^>]*src=\"([^\"]+)\"")


def prose(page):
    """The text of a page without its blocks and its inline code."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`\n]*`", "code", text)


def anchors(page):
    """The names of a page's headings, as GitHub and the book make them."""
    text = re.sub(r"^ *```.*?^ *```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
    found = set()
    for heading in re.findall(r"^#+ +(.+?)\s*$", text, re.MULTILINE):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        found.add(re.sub(r"[^\w\- ]", "", plain).replace(" ", "-"))
    return found


def faults(page):
    """What is wrong with the links of a page."""
    for link in LINK.finditer(prose(page)):
        target = link[1] or link[2]
        if re.match(r"[a-z]+:", target):
            if not urllib.parse.urlsplit(target).netloc or not target.startswith("https://"):
                yield f"`{target}` is no https address"
            continue
        name, _, anchor = target.partition("#")
        path = (page.parent / name).resolve() if name else page
        if not path.is_relative_to(ROOT):
            yield f"`{target}` leaves the project"
        elif not path.exists():
            yield f"`{target}` is not there"
        elif anchor and anchor not in anchors(path):
            yield f"`{target}`: no heading is called so"


def main():
    more = [
        ROOT / name
        for name in (
            "ARCHITECTURE.md",
            "CONTRIBUTING.md",
            "SECURITY.md",
            "examples/README.md",
            "firmware/cell/README.md",
        )
    ]
    wrong = 0
    for page in [*pages(), *(page for page in more if page.exists())]:
        for fault in faults(page):
            print(f"{page.relative_to(ROOT)}: {fault}")
            wrong += 1
    # the lines of a table are no words
    words = sum(any(map(str.isalnum, word)) for word in (ROOT / "README.md").read_text().split())
    if words > 900:
        print(f"README.md: {words} words, 900 at most")
        wrong += 1
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
