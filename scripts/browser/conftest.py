"""A browser for the tests of pages: `make browser`, or `python -m pytest scripts/browser`.

The tests use Debian's Chromium (`apt-get install chromium`). They fail without it where CI is set, and are skipped elsewhere.
`--shots FOLDER` keeps a picture of every page at every width, to be looked at.
"""

import os
import pathlib
import shutil

import pytest

ROOT = pathlib.Path(__file__).parents[2]
# a telephone, a tablet, a desk
WIDTHS = (390, 820, 1400)

# Elements that are wider than the page, by tag and class. Text in a box that scrolls by itself is no fault.
OVERFLOW = """() => {
  const wide = document.documentElement.clientWidth + 1;
  if (document.documentElement.scrollWidth <= wide) return [];
  return [...document.querySelectorAll('body *')]
    .filter(e => e.getBoundingClientRect().right > wide)
    .map(e => e.tagName + '.' + e.className).slice(0, 5).concat(['the page scrolls sideways']);
}"""

# Pictures that did not load
BROKEN_IMAGES = """() => [...document.images].filter(i => i.complete && i.naturalWidth === 0).map(i => i.src)"""


def pytest_addoption(parser):
    parser.addoption("--spts", type=pathlib.Path, default=ROOT / "target/release/spts", help="the program")
    parser.addoption("--chromium", type=pathlib.Path, default=shutil.which("chromium"), help="the browser")
    parser.addoption("--shots", type=pathlib.Path, default=None, help="folder for pictures of the pages")


@pytest.fixture(scope="session")
def root():
    """The folder of the project."""
    return ROOT


@pytest.fixture(scope="session")
def program(request):
    """The `spts` program."""
    path = request.config.getoption("--spts")
    assert path.is_file(), f"{path}: not there; build it with `cargo build --release --workspace` or say --spts PATH"
    return path.resolve()


@pytest.fixture(scope="session")
def browser(request):
    """Chromium without a window."""
    path = request.config.getoption("--chromium")
    if path is None or not path.is_file():
        message = "Chromium is not there: apt-get install chromium, or say --chromium PATH"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    from playwright.sync_api import sync_playwright

    # nothing may leave this machine, and a container's root has no sandbox
    quiet = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]
    quiet += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=str(path), args=quiet)
        yield chromium
        chromium.close()


class Visit:
    """A page in the browser, and what it complained of."""

    def __init__(self, browser, width, scheme, shots):
        self.context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.page = self.context.new_page()
        self.width, self.scheme, self.shots = width, scheme, shots
        self.complaints = []
        self.page.on("console", lambda m: self.complaints.append(m.text) if m.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        # what a page still loads when it is left is aborted, and no fault
        self.page.on(
            "requestfailed",
            lambda r: self.complaints.append(f"{r.url}: {r.failure}") if r.failure != "net::ERR_ABORTED" else None,
        )

    def open(self, address):
        """Opens an address, or a file, and waits until nothing loads any more."""
        if isinstance(address, pathlib.Path):
            address = address.resolve().as_uri()
        self.page.goto(address, wait_until="load")
        return self.page

    def resize(self, width):
        """Gives the window another width, with everything at its place at once."""
        self.page.add_style_tag(content="* { transition: none !important }")
        self.page.set_viewport_size({"width": width, "height": 900})
        # what follows the width has done so
        self.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        self.width = width

    def check(self):
        """Fails if the page is wider than the window, lacks a picture, or complained in the console."""
        assert self.page.evaluate(OVERFLOW) == [], f"wider than {self.width} px: {self.page.url}"
        assert self.page.evaluate(BROKEN_IMAGES) == [], f"pictures that did not load: {self.page.url}"
        assert self.complaints == [], self.page.url

    def shoot(self, name):
        """Keeps a picture of the whole page, if `--shots` says where."""
        if self.shots is not None:
            self.shots.mkdir(parents=True, exist_ok=True)
            self.page.screenshot(path=self.shots / f"{name}_{self.width}_{self.scheme}.png", full_page=True)


@pytest.fixture
def visit(request, browser):
    """`visit(width=1400, scheme="light")` is a `Visit`, closed when the test ends."""
    visits = []

    def make(width=1400, scheme="light"):
        visits.append(Visit(browser, width, scheme, request.config.getoption("--shots")))
        return visits[-1]

    yield make
    for one in visits:
        one.context.close()
