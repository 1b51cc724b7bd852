"""A dry run of a release: what would be uploaded, checked as its users would meet it; nothing leaves this machine.

The packages are built from what is committed, the sdist is unpacked and passes a part of its own tests, the wheel is
installed alone and gives a tour, and dist/ also gets a software bill of materials (CycloneDX) of that installation. An
index shows a README without its neighbours, so that links and pictures there are made absolute by --base, the address
that the repository's files have; without it pictures are left out, and links are their text.

    make release
    make release BASE=https://example.org/ovita/raw/main/
"""

import argparse
import os
import re
import subprocess
import sys
import tarfile
import venv
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
TOOLS = ("build", "hatchling", "twine", "cyclonedx-bom")
SUBSET = (
    "tests/test_layers.py",
    "tests/test_units_and_text.py",
    "tests/test_readme.py",
    "tests/test_plugins.py",
    "tests/io",
)
"""Tests of the unpacked sdist: they read the package, its pages and its data."""

_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!\w+:|#)([^)\s]+)\)")


def for_an_index(readme: str, base: str) -> str:
    """A README whose relative links and pictures lead somewhere from any page, or are left out."""

    def absolute(link: re.Match[str]) -> str:
        picture, text, target = link.groups()
        if base:
            return f"{picture}[{text}]({base.rstrip('/')}/{target})"
        return "" if picture else text

    return _LINK.sub(absolute, readme)


def run(*command: object, cwd: Path = ROOT, **environment: str) -> str:
    """Run a command; end with what it said if it fails."""
    words = [str(word) for word in command]
    done = subprocess.run(words, cwd=cwd, env=os.environ | environment, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(words)}\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout


def python_in(folder: Path, *packages: object) -> Path:
    """The Python of a fresh virtual environment with these packages."""
    venv.create(folder, with_pip=True, clear=True)
    python = folder / "bin" / "python"
    run(python, "-m", "pip", "--disable-pip-version-check", "-q", "install", *packages)
    return python


def main() -> None:
    """Do it."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--base", default="", help="Address of the repository's files, for the links of the README.")
    base, dist = options.parse_args().base, ROOT / "dist"
    dist.mkdir(exist_ok=True)
    for old in dist.iterdir():
        old.unlink()
    with TemporaryDirectory() as folder:
        tree, unpacked = Path(folder) / "tree", Path(folder) / "unpacked"
        tree.mkdir()
        run("sh", "-c", f"git archive HEAD | tar x -C '{tree}'")
        page = tree / "README.md"
        shown = for_an_index(page.read_text(encoding="utf-8"), base)
        tools = python_in(Path(folder) / "tools", *TOOLS)
        # The sdist keeps the README of the repository, whose neighbours it has; the wheel's is what an index shows.
        run(tools, "-m", "build", "--no-isolation", "--sdist", "--outdir", dist, cwd=tree)
        page.write_text(shown, encoding="utf-8")
        run(tools, "-m", "build", "--no-isolation", "--wheel", "--outdir", dist, cwd=tree)
        run(tools, "-m", "twine", "check", "--strict", *dist.iterdir())
        print("built:", *(f"{path.name} ({path.stat().st_size / 1e6:.1f} MB)" for path in sorted(dist.iterdir())))

        with tarfile.open(next(dist.glob("*.tar.gz"))) as archive:
            archive.extractall(unpacked, filter="data")
        home = next(unpacked.iterdir())
        said = run(sys.executable, "-m", "pytest", "-q", *SUBSET, cwd=home, PYTHONPATH=str(home / "src"))
        print("the sdist's own tests:", said.strip().splitlines()[-1])

        user = python_in(Path(folder) / "user", next(dist.glob("*.whl")))
        run(user, "-m", "ovita", "tour", "--yes", cwd=unpacked)
        print("the wheel, installed alone:", run(user, "-m", "ovita", "--version", cwd=unpacked).strip(), "and a tour")
        bill = dist / f"{home.name}.cdx.json"
        cyclonedx = Path(folder) / "tools" / "bin" / "cyclonedx-py"
        run(cyclonedx, "environment", "--output-reproducible", "-o", bill, user)
    print(f"bill of materials: {bill.name}\nNothing was uploaded; that is: twine upload dist/*.whl dist/*.tar.gz")


if __name__ == "__main__":
    main()
