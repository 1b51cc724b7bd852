"""Whether the lower bounds in pyproject.toml are true: the tests below pass with the lowest versions that it allows.

Makes a virtual environment of its own (.venv-lowest) with the lowest version of every dependency that has a wheel for
this Python, in the extras named below, and runs tests in it. What those versions need themselves is not held down.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parent.parent
HOME = ROOT / ".venv-lowest"
EXTRAS = ("plot", "tuning", "mavlink", "ros", "sim", "studio")
"""Those with wheels of their own; `llm` needs newer versions of what the rest needs, and so has bounds of its own."""
TOOLS = ("pytest", "hypothesis")
SMOKE = (
    "tests/test_chain.py",
    "tests/test_cli.py",
    "tests/test_confirmation.py",
    "tests/test_gate.py",
    "tests/test_plots.py",
    "tests/test_session.py",
    "tests/test_session_files.py",
    "tests/dialogue",
    "tests/io",
    "tests/limits",
    "tests/links",
    "tests/policy/test_policy_direct.py",
    "tests/policy/test_policy_sandbox.py",
    "tests/sim/test_simulate.py",
    "tests/studio/test_studio.py",
    "tests/toolkit",
)


def requirements() -> dict[str, str]:
    """Every direct requirement as "name[extras]" and its specifier, ovita's own extras left out."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [*project["dependencies"], *(r for extra in EXTRAS for r in project["optional-dependencies"][extra])]
    split = (re.match(r"([\w.\[\],-]+?)\s*([<>=!~].*)?$", line) for line in lines)
    found = {m[1]: m[2] or "" for m in split if m is not None}
    return {name: bound for name, bound in found.items() if not name.startswith("ovita")}


def pip(*words: str, check: bool = True) -> str:
    """What pip complains of for these arguments."""
    run = [str(HOME / "bin/python"), "-m", "pip", "--disable-pip-version-check", *words]
    done = subprocess.run(run, check=False, text=True, stderr=subprocess.PIPE, cwd=ROOT)
    if check and done.returncode:
        sys.exit(done.stderr)
    return done.stderr


def lowest(name: str, bound: str) -> str:
    """The lowest version within the bound that has a wheel for this Python."""
    from packaging.specifiers import SpecifierSet
    from packaging.version import InvalidVersion, Version

    def read(text: str) -> Version | None:
        try:
            return Version(text.strip())
        except InvalidVersion:  # some projects have uploads of before there was a rule
            return None

    # pip names the versions that it could install where it finds none; `pip index` also names those without a wheel
    impossible = f"{name.partition('[')[0]}<0.0.0.dev0"
    listed = pip("install", "--dry-run", "--no-deps", "--only-binary=:all:", impossible, check=False)
    versions = re.search(r"from versions: ([^)]*)\)", listed)
    if versions is None:
        sys.exit(f"pip lists no versions of {name}")
    legal = SpecifierSet(bound).filter(v for v in map(read, versions[1].split(",")) if v is not None)
    return f"{name}=={min(legal)}"


def main() -> int:
    """Make the environment, say what is in it, and run the smoke set."""
    if not (HOME / "bin/python").exists():
        subprocess.run([sys.executable, "-m", "venv", str(HOME)], check=True)
    pip("install", "-q", "packaging")
    sys.path += map(str, HOME.glob("lib/*/site-packages"))
    pins = [lowest(name, bound) for name, bound in requirements().items()]
    print("\n".join(pins), flush=True)
    pip("install", "-q", "--only-binary=:all:", "-e", ".", *pins)
    pip("install", "-q", "-c", "constraints.txt", *TOOLS)
    return subprocess.run(
        [str(HOME / "bin/python"), "-m", "pytest", "-W", "default", *SMOKE, *sys.argv[1:]], cwd=ROOT
    ).returncode


if __name__ == "__main__":
    sys.exit(main())
