"""The page of `spts reproduce`, at three widths, light and dark, and printed.

SPTS_REPORT names its folder; `make browser` makes one without recordings.
"""

import os
import pathlib
import re
import urllib.parse

import pytest
from conftest import WIDTHS

SCHEMES = ("light", "dark")

# Names of programs and files, which nobody who reads the page knows: words with an underscore, and short names of
# objects
INTERNAL = re.compile(r"\b[A-Za-z]+[0-9]*_[A-Za-z0-9_]+\b|\b(?:rec|trig|smallT)\b")
# The platform in the provenance
KNOWN = {"x86_64"}

# Text whose contrast with what is behind it is below 4.5, or 3 for large text (WCAG 2.2, 1.4.3). Boxes behind it may be
# transparent.
FAINT = """() => {
  const parse = c => (c.match(/[0-9.]+/g) || [0, 0, 0, 0]).map(Number);
  const over = ([r, g, b, a = 1], under) => [r, g, b].map((v, i) => a * v + (1 - a) * under[i]);
  const light = c => c.map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = e => {
    const boxes = [];
    for (; e; e = e.parentElement) boxes.push(parse(getComputedStyle(e).backgroundColor));
    return boxes.reverse().reduce((under, box) => over(box, under), [255, 255, 255]);
  };
  const faint = new Set();
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const e = texts.currentNode.parentElement, style = getComputedStyle(e);
    if (!texts.currentNode.data.trim() || style.display === 'none') continue;
    const under = behind(e), ink = over(parse(style.color), under);
    const [high, low] = [light(ink), light(under)].sort((a, b) => b - a);
    const ratio = (high + 0.05) / (low + 0.05);
    const size = parseFloat(style.fontSize), large = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
    if (ratio < (large ? 3 : 4.5)) faint.add(`${ratio.toFixed(2)}: ${texts.currentNode.data.trim().slice(0, 40)}`);
  }
  return [...faint];
}"""


@pytest.fixture(scope="session")
def report():
    """Folder of a report."""
    there = os.environ.get("SPTS_REPORT")
    if not there:
        missing = pytest.fail if os.environ.get("CI") else pytest.skip
        missing("SPTS_REPORT names no report; `make browser` makes one")
    return pathlib.Path(there)


@pytest.fixture
def opened(visit, report):
    """`opened(width, scheme)`: the visit, and the page of the report in it."""

    def make(width=1400, scheme="light"):
        one = visit(width, scheme)
        return one, one.open(report / "index.html")

    return make


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("width", WIDTHS)
def test_fits_and_is_readable(opened, width, scheme):
    one, page = opened(width, scheme)
    one.shoot("report")
    one.check()
    assert page.evaluate(FAINT) == []


def test_every_link_and_picture_is_there(opened, report):
    _, page = opened()
    for address in page.eval_on_selector_all("a", "all => all.map(a => a.getAttribute('href'))"):
        if address.startswith("#"):
            assert page.locator(f"[id='{address[1:]}']").count() == 1, address
        else:
            assert (report / urllib.parse.unquote(address)).is_file(), address
    for picture in page.query_selector_all("img"):
        picture.scroll_into_view_if_needed()
        assert picture.evaluate("p => p.decode().then(() => p.naturalWidth)") > 0


def test_structure(opened):
    _, page = opened()
    levels = page.eval_on_selector_all("h1, h2, h3, h4", "all => all.map(h => Number(h.tagName[1]))")
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(levels, levels[1:])), levels
    alts = page.eval_on_selector_all("img", "all => all.map(p => p.alt)")
    assert len(alts) > 8 and all(len(alt) > 20 for alt in alts), alts
    captions = page.eval_on_selector_all("figcaption", "all => all.map(c => c.innerText)")
    assert all(len(caption) > 20 for caption in captions), captions
    sections = page.eval_on_selector_all("main > section", "all => all.map(s => s.id)")
    linked = page.eval_on_selector_all("nav a", "all => all.map(a => a.getAttribute('href').slice(1))")
    assert sections[0] == "main-figures" and sections[1:] == linked and linked[-2:] == ["glossary", "provenance"]


def test_cards_are_full(opened):
    _, page = opened()
    cards = page.eval_on_selector_all(".card", "all => all.map(c => c.innerText)")
    assert len(cards) >= 6
    for card in cards:
        assert not re.search(r"–(?!\d)|NaN|\bnull\b", card), card
        assert any(digit in card for digit in "0123456789"), card
    if "No recordings of the real skin" in page.inner_text("header"):
        text = page.inner_text("main")
        assert not any("real skin" in card for card in cards)
        assert "both skins" not in text and "both arms" not in text


def test_plain_words(opened, report):
    _, page = opened()
    words = page.inner_text("body") + " ".join(page.eval_on_selector_all("img", "all => all.map(p => p.alt)"))
    texts = {"index.html": words}
    for figure in (report / "figures").glob("*.svg"):
        texts[figure.name] = " ".join(re.findall(r">([^<>]+)</(?:text|title)", figure.read_text()))
    for name, text in texts.items():
        assert set(INTERNAL.findall(text)) <= KNOWN, name
        assert "〃" not in text, name


def test_prints(opened, tmp_path):
    one, page = opened(700)
    page.emulate_media(media="print")
    one.check()
    assert page.locator("nav").evaluate("n => getComputedStyle(n).display") == "none"
    assert page.evaluate(FAINT) == []
    printed = page.pdf(path=tmp_path / "report.pdf", format="A4", print_background=True)
    assert printed.startswith(b"%PDF") and len(re.findall(rb"/Type\s*/Page\b", printed)) > 4
    if one.shots is not None:
        (one.shots / "report.pdf").write_bytes(printed)
