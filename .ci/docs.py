"""Build the site of the documentation into site/, strictly: a link that leads nowhere ends it.

The pages are docs/, with the README as the first of them and what contributors and upgraders read beside it. The site
asks nobody for anything: no font, script or picture comes from elsewhere, and the search runs from a folder, too.

    make docs
"""

import html
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag

ROOT = Path(__file__).parents[1]
PAGES, SITE = ROOT / "build" / "pages", ROOT / "site"
TOP = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
WORKER = "https://unpkg.com/iframe-worker/shim"
_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((?!\w+:|#)([^)\s#]+)(#[^)\s]*)?\)")
_BARS = re.compile(r"`([^`\n]*\\\|[^`\n]*)`")
"""Code in tables whose bars are escaped, as GitHub wants them."""


def page(text: str, folder: Path) -> str:
    """A page of the repository as one of the site; what the site does not have stays as its words."""

    def there(link: re.Match[str]) -> str:
        words, target, anchor = link.groups()
        path = (folder / target).resolve().relative_to(ROOT)
        if path.parts[0] == "docs" and path.suffix == ".md":
            return f"[{words}]({path.relative_to('docs')}{anchor or ''})"
        return f"[{words}]({TOP[str(path)]}{anchor or ''})" if str(path) in TOP else words

    linked = _LINK.sub(there, text).replace("](docs/images/", "](images/")
    return _BARS.sub(lambda code: f"<code>{html.escape(code[1]).replace(chr(92) + '|', '&#124;')}</code>", linked)


def lay_out() -> None:
    """Everything that the site is made of, in build/pages."""
    shutil.rmtree(PAGES, ignore_errors=True)
    shutil.copytree(ROOT / "docs", PAGES, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    sources = {path: path.name for path in sorted((ROOT / "docs").glob("*.md"))}
    for source, name in (sources | {ROOT / name: name for name in TOP}).items():
        shown = page(source.read_text(encoding="utf-8"), source.parent)
        (PAGES / TOP.get(name, name)).write_text(shown, encoding="utf-8")


class _Page(HTMLParser):
    """What a page leads to, what it loads, and the places in it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.places: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {key: value or "" for key, value in attrs}
        self.places |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag != "a" and not (tag == "link" and given.get("rel") in ("canonical", "prev", "next")):
            self.loads += [given[key] for key in ("src", "href") if given.get(key)]


def faults(site: Path) -> Iterator[str]:
    """What a reader without a network misses: links and pictures that lead nowhere, and what comes from elsewhere."""
    pages = {path.resolve(): _Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    for path, shown in pages.items():
        for address in shown.loads:
            if re.match(r"(\w+:)?//", address):
                yield f"{path.name} loads {address}"
        for address in shown.links + shown.loads:
            target, anchor = urldefrag(unquote(address))
            if re.match(r"\w+:|//", target) or path.name == "404.html":
                continue
            there = (path.parent / target).resolve() if target else path
            if not there.exists():
                yield f"{path.name} leads to {address}, which is not there"
            elif anchor and there in pages and anchor not in pages[there].places and anchor != "__skip":
                yield f"{path.name} leads to {address}, which {there.name} does not have"


def main() -> None:
    """Do it."""
    lay_out()
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean"]
    if code := subprocess.run(command, cwd=ROOT).returncode:
        sys.exit(code)
    # A worker may not be started from a file; the script that stands in for it lies beside the pages.
    for path in SITE.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace(WORKER, "assets/iframe-worker.js"), encoding="utf-8")
    if found := sorted(set(faults(SITE))):
        sys.exit("\n".join(found))
    print(f"{len(list(SITE.rglob('*.html')))} pages: open {(SITE / 'index.html').relative_to(ROOT)}")


if __name__ == "__main__":
    main()
