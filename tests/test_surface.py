"""The public names are sorted, importable and cheap to import."""

import subprocess
import sys
from importlib.util import find_spec

import ovita


def test_public_names_are_sorted_and_importable():
    assert list(ovita.__all__) == sorted(ovita.__all__)
    assert set(ovita.__all__) == set(ovita._HOMES)
    for name in ovita.__all__:
        assert getattr(ovita, name) is not None
    assert set(ovita.__all__) <= set(dir(ovita))


def test_no_module_hides_a_public_name():
    for name in ovita.__all__:
        assert find_spec(f"ovita.{name}") is None, f"importing ovita.{name} would hide the public name"


def test_version_is_that_of_the_changelog_and_the_package():
    from importlib.metadata import version
    from pathlib import Path

    assert version("ovita") == ovita.__version__
    changelog = (Path(__file__).parents[1] / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{ovita.__version__}]" in changelog


def test_import_and_help_load_nothing_heavy():
    code = (
        "import sys, ovita, ovita.cli.main as m\n"
        "try:\n    m.cli(['--help'], standalone_mode=False)\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'scipy', 'pydantic', 'rich', 'matplotlib', 'pydantic_ai', 'piqp'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "adapt" in done.stdout and "demo" in done.stdout


def test_make_lowest_tries_every_dependency_of_its_own():
    """pydantic was allowed in a version that could not read our own results: the bounds had never been tried."""
    import runpy
    import tomllib
    from pathlib import Path

    root = Path(__file__).parents[1]
    tried = runpy.run_path(str(root / ".ci/lowest.py"))["requirements"]()
    own = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"]
    assert {line.partition(">=")[0] for line in own} <= set(tried)
    assert all(bound.startswith(">=") for bound in tried.values()), tried
