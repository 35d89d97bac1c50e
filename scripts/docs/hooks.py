"""What MkDocs has to know of this project: pages of the book that lie elsewhere in the repository, and links to files.

README.md and the pages in docs/ link to each other and to files of the repository as one finds them there. In the book,
some of those files are pages, other files are copied beside it, and a folder is named without a link.
"""

import pathlib
import posixpath
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parents[2]
# pages of the book that are not in docs/, by their paths in the repository
ELSEWHERE = {
    "ARCHITECTURE.md": "architecture.md",
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "examples/README.md": "examples.md",
    "firmware/cell/README.md": "cell.md",
}
LINK = re.compile(r"(?<!!)\[([^\]\n]+)\]\(([^)\s]+)\)")


def on_files(files, config):
    """Adds the pages from elsewhere, and every file that some page links to."""
    for source, name in ELSEWHERE.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    linked = set()
    for file in files:
        if file.is_documentation_page():
            for _, target in LINK.findall(file.content_string):
                linked.add(in_repository(file.src_uri, target))
    for path in sorted(linked - {None}):
        if path not in ELSEWHERE and not path.startswith("docs/") and copied(path):
            files.append(File.generated(config, f"source/{path}", abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown, page, **_):
    """Turns links that leave docs/ to where their targets are in the book."""
    here = page.file.src_uri

    def turn(link):
        text, target = link.groups()
        path = in_repository(here, target)
        if path is None:
            return link[0]
        anchor = target[target.index("#") :] if "#" in target else ""
        if path in ELSEWHERE:
            return f"[{text}]({ELSEWHERE[path]}{anchor})"
        if path.startswith("docs/"):
            return f"[{text}]({path.removeprefix('docs/')}{anchor})"
        if copied(path):
            return f"[{text}](source/{path})"
        return text

    return LINK.sub(turn, markdown)


def copied(path):
    """Whether the file at `path` is copied beside the book: MkDocs leaves hidden folders out."""
    return (ROOT / path).is_file() and not any(part.startswith(".") for part in path.split("/"))


def in_repository(page, target):
    """Path in the repository of a link's target, if it leaves the folder of pages; `page` is a path in the book."""
    if re.match(r"[a-z]+:|#", target):
        return None
    sources = {name: source for source, name in ELSEWHERE.items()}
    home = posixpath.dirname(sources.get(page, f"docs/{page}"))
    path = posixpath.normpath(posixpath.join(home, target.split("#")[0]))
    return None if path.startswith("docs/") and page not in sources else path
