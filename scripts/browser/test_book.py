"""The book: every page at three widths, in light and dark. `make book` builds it."""

import functools
import http.server
import os
import threading

import pytest
from conftest import ROOT, WIDTHS

BOOK = ROOT / "out/book"
PAGES = sorted(path.relative_to(BOOK).as_posix() for path in BOOK.glob("*.html"))


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def address():
    """Where the book is served: its search needs a server, as in any browser."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=BOOK))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


def test_the_book_is_there():
    if not BOOK.is_dir():
        missing = pytest.fail if os.environ.get("CI") else pytest.skip
        missing(f"{BOOK}: not there; `make book` builds it")
    assert len(PAGES) > 20, PAGES


@pytest.mark.skipif(not PAGES, reason="the book is not built")
# for two workers
@pytest.mark.parametrize("half", (0, 1))
def test_every_page_fits(half, visit, address):
    one = visit()
    for page in PAGES[half::2]:
        # loaded as on a telephone, then made wider
        one.resize(WIDTHS[0])
        one.open(f"{address}/{page}")
        for width in WIDTHS:
            one.resize(width)
            one.check()
            one.shoot(f"book_{page.removesuffix('.html')}")


@pytest.mark.skipif(not PAGES, reason="the book is not built")
def test_the_dark_is_dark(visit, address):
    one = visit(WIDTHS[0], scheme="dark")
    for page in ("index.html", "scenes.html", "validation.html"):
        one.open(f"{address}/{page}")
        one.check()
        ground = one.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert max(int(part) for part in ground.strip("rgba()").split(",")[:3]) < 80, ground
        one.shoot(f"book_{page.removesuffix('.html')}")


@pytest.mark.skipif(not PAGES, reason="the book is not built")
def test_the_search_finds_a_field(visit, address):
    one = visit()
    page = one.open(f"{address}/index.html")
    # the index is loaded when the field is entered
    page.click("input.md-search__input")
    page.keyboard.type("cells_per_taxel", delay=20)
    page.wait_for_selector(".md-search-result__item a", timeout=60_000)
    found = page.locator(".md-search-result__item a").evaluate_all("links => links.map(a => a.getAttribute('href'))")
    assert any("scenes" in address for address in found), found
    one.check()


@pytest.mark.skipif(not PAGES, reason="the book is not built")
def test_nothing_is_fetched_from_elsewhere(visit, address):
    one = visit()
    asked = []
    one.page.on("request", lambda request: asked.append(request.url))
    one.open(f"{address}/scenes.html")
    assert asked
    assert [url for url in asked if not url.startswith((address, "data:"))] == []
