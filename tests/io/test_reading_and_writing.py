import os
import stat

import pytest

from ovita.errors import FormatError
from ovita.io import atomic_write, files, load_task


def fails(action, *fragments):
    with pytest.raises(FormatError) as caught:
        action()
    message = str(caught.value)
    for fragment in fragments:
        assert fragment in message
    assert "\n" not in message
    return caught.value


def test_a_missing_file_is_named(tmp_path):
    path = tmp_path / "none.json"
    fails(lambda: load_task(path), str(path), "there is no such file")


def test_a_folder_is_no_file(tmp_path):
    fails(lambda: load_task(tmp_path), "this is a folder")
    fails(lambda: load_task(str(tmp_path) + "/x.json/deeper.json"), "no such file")
    (tmp_path / "x.json").mkdir()
    fails(lambda: load_task(tmp_path / "x.json"), "this is a folder")


def test_a_path_through_a_file_cannot_be_opened(tmp_path):
    (tmp_path / "a.json").write_text("{}")
    fails(lambda: load_task(tmp_path / "a.json" / "b.json"), "cannot be opened: not a directory")


@pytest.mark.parametrize("name", ["a\0b.json", "x" * 5000 + ".json"])
def test_impossible_names_are_errors_not_tracebacks(name):
    fails(lambda: load_task(name), "cannot be opened")
    fails(lambda: atomic_write(name, "x"), "cannot be written")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "p.json")
    fails(lambda: load_task(tmp_path / "p.json"), "device or a pipe")


def test_a_sparse_file_of_two_gigabytes_is_refused_unread(tmp_path, monkeypatch):
    path = tmp_path / "huge.json"
    with open(path, "wb") as stream:
        stream.truncate(2 * 2**30)
    monkeypatch.setattr(files, "open", lambda *_: pytest.fail("it was opened"), raising=False)
    fails(lambda: load_task(path), "too large (2048 MB)", "256 MB")


def test_a_file_that_grows_while_it_is_read_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "growing.json"
    path.write_text(" " * 100)
    monkeypatch.setattr(files, "MAX_BYTES", 50)
    monkeypatch.setattr(files, "examine", lambda _: None)
    fails(lambda: files.read_text(path), "too large")


def test_an_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "secret.json"
    path.write_text("{}")

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files, "open", refuse, raising=False)
    fails(lambda: load_task(path), "no permission to read")


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        (b"", "the file is empty"),
        (b" \n\t", "the file is empty"),
        (b"\xef\xbb\xbf", "the file is empty"),
        (b"\xff\xfe{\x00}\x00", "not UTF-8 text (byte 0xff at offset 0)"),
        (b'{"a": "\xe9"}', "byte 0xe9 at offset 7"),
    ],
)
@pytest.mark.parametrize("ending", [".json", ".csv"])
def test_text_that_is_not_there(tmp_path, content, fragment, ending):
    path = tmp_path / f"t{ending}"
    path.write_bytes(content)
    fails(lambda: load_task(path), fragment)


@pytest.mark.parametrize(("name", "fragment"), [("a.xyz", "the ending .xyz"), ("a", "a name without an ending")])
def test_an_unknown_ending(tmp_path, name, fragment):
    (tmp_path / name).write_text("x")
    fails(lambda: load_task(tmp_path / name), fragment, ".json, .csv")


def test_write_replaces_the_content_and_keeps_access_rights(tmp_path):
    path = tmp_path / "out.json"
    path.write_text("old")
    path.chmod(0o640)
    atomic_write(path, "n\u00e9w")
    assert path.read_bytes() == b"n\xc3\xa9w"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["out.json"]


def test_write_of_a_new_file_obeys_the_umask(tmp_path):
    plain, atomic = tmp_path / "plain", tmp_path / "atomic"
    plain.write_text("")
    atomic_write(atomic, b"bytes")
    assert atomic.stat().st_mode == plain.stat().st_mode
    assert atomic.read_bytes() == b"bytes"


def test_write_follows_a_link_instead_of_replacing_it(tmp_path):
    (tmp_path / "deep").mkdir()
    target, link = tmp_path / "deep" / "real.json", tmp_path / "link.json"
    target.write_text("old")
    link.symlink_to(target)
    atomic_write(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_write_to_a_device_does_not_replace_it():
    atomic_write("/dev/null", "gone")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_write_into_a_missing_folder(tmp_path):
    fails(lambda: atomic_write(tmp_path / "no" / "x.json", ""), f"the folder {tmp_path / 'no'} does not exist")
    (tmp_path / "file").write_text("")
    fails(lambda: atomic_write(tmp_path / "file" / "x.json", ""), "does not exist")


def test_write_onto_a_folder(tmp_path):
    fails(lambda: atomic_write(tmp_path, ""), "this is a folder")


def test_write_onto_a_protected_file(tmp_path, monkeypatch):
    path = tmp_path / "x.json"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda *_: False)
    fails(lambda: atomic_write(path, "new"), "write-protected")
    assert path.read_text() == "old"


@pytest.mark.parametrize(
    ("error", "fragment"),
    [(PermissionError(13, "Permission denied"), "no permission"), (OSError(28, "No space left"), "no space left")],
)
def test_a_failed_write_leaves_the_old_content_and_no_litter(tmp_path, monkeypatch, error, fragment):
    path = tmp_path / "x.json"
    path.write_text("old")

    def refuse(*_):
        raise error

    monkeypatch.setattr(os, "fsync", refuse)
    fails(lambda: atomic_write(path, "new"), fragment)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["x.json"]


def test_an_interrupted_write_leaves_no_litter(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        atomic_write(tmp_path / "x.json", "new")
    assert os.listdir(tmp_path) == []


def test_text_that_is_not_unicode_is_not_written(tmp_path):
    fails(lambda: atomic_write(tmp_path / "x.json", "\ud800"), "not valid Unicode")
    assert os.listdir(tmp_path) == []
