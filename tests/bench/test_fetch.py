"""Fetching downloads, verifies and resumes; offline it says what to put where."""

import hashlib
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from click.testing import CliRunner

from ovita.bench import dataset as source
from ovita.cli.bench_ import group

FILES = {"latte_subset/latte_0": b'{"a": 1}', "robot_subset/Drone/drone_trajectory_1": b'{"b": 2}'}


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *args):
        pass


@pytest.fixture
def server(tmp_path):
    root = tmp_path / "served"
    for name, data in FILES.items():
        file = root / f"{name}.json"
        file.parent.mkdir(parents=True)
        file.write_bytes(data)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(root))) as http:
        thread = Thread(target=http.serve_forever)
        thread.start()
        yield root, f"http://127.0.0.1:{http.server_port}"
        http.shutdown()
        thread.join()


@pytest.fixture
def two(monkeypatch):
    sums = {name: hashlib.sha256(data).hexdigest() for name, data in FILES.items()}
    monkeypatch.setattr(source, "checksums", lambda: sums)


def test_what_is_missing_is_downloaded_and_what_is_whole_is_kept(server, two, tmp_path):
    _, url = server
    out = tmp_path / "out"
    first = source.fetch(out, base_url=url)
    assert (first.whole, first.downloaded) == (2, 2)
    assert (out / "robot_subset/Drone/drone_trajectory_1.json").read_bytes() == b'{"b": 2}'
    assert source.verify(out) == ([], [])
    (out / "latte_subset/latte_0.json").write_bytes(b"torn")
    assert source.verify(out) == ([], ["latte_subset/latte_0"])
    assert source.fetch(out, base_url=url + "/").downloaded == 1


def test_a_file_that_differs_is_not_saved(server, two, tmp_path):
    root, url = server
    (root / "latte_subset/latte_0.json").write_bytes(b'{"a": 2}')
    with pytest.raises(source.FetchError, match=r"latte_0\.json arrived, but differs"):
        source.fetch(tmp_path / "out", base_url=url)
    assert source.verify(tmp_path / "out") == (list(FILES), [])


def test_a_missing_file_and_no_network_say_what_to_put_where(server, two, tmp_path):
    root, url = server
    (root / "latte_subset/latte_0.json").unlink()
    out = tmp_path / "out"
    with pytest.raises(source.FetchError, match="answers 404") as missing:
        source.fetch(out, base_url=url)
    with pytest.raises(source.FetchError, match="cannot be reached") as offline:
        source.fetch(out, base_url="http://127.0.0.1:9", timeout=2)
    for error in (missing, offline):
        assert "MarkusKnauer/OVITA" in str(error.value) and str(out) in str(error.value)
    with pytest.raises(source.FetchError, match="no web address"):
        source.fetch(out, base_url="file:///etc")


def test_the_command_says_where_files_went(server, two, tmp_path):
    _, url = server
    done = CliRunner().invoke(group, ["fetch", "--out", str(tmp_path / "o"), "--base-url", url], catch_exceptions=False)
    assert done.exit_code == 0 and "2 files" in done.output and "ovita bench run" in done.output


def test_the_shipped_list_names_the_cases_and_no_sentence():

    sums = source.checksums()
    assert len(sums) == 114 and all(len(digest) == 64 for digest in sums.values())
    assert all(name in source.shipped_cases() for name in sums)


def test_the_local_copy_is_as_published():
    folder = Path(__file__).parents[2].parent / "shared" / "data" / "ovita-dev"
    if not folder.exists():
        pytest.skip(f"the dataset is not at {folder}; its licence keeps it out of here")
    assert source.verify(folder) == ([], [])
