"""`ovita augment inspect` and the card: what they say of a dataset is what is in it."""

from __future__ import annotations

import json

import pytest

from command_line import ovita
from ovita.augment.card import licences_from
from ovita.augment.inspection import open_manifest, sample_at, samples_from_all_over, verify
from ovita.errors import RequestError
from ovita.result import Adaptation


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data") / "made"
    done = ovita("augment", "random", "--n", "30", "--shard", "8", "--families", "shift,speed", "--out", str(folder))
    assert done.returncode == 0, done.stderr
    return folder


def test_the_card_says_what_is_there(data):
    card, manifest = (data / "README.md").read_text(), open_manifest(data)
    assert card.startswith("---\nlicense: apache-2.0\n") and f"# {manifest['kept']} verified pairs of" in card
    assert "| random:drone | ovita.bench.generate | ovita's own, Apache-2.0 |" in card
    for family, count in manifest["counts"]["family"].items():
        assert f"{family} {count} (" in card
    for text in ("What it is not", "no pictures", "| seed | 0 |", "SHA-256"):
        assert text in card


def test_licences_are_said_of_sources_that_are_there():
    sources = ["random:drone", "file:demos/a.json", "file:walk.csv"]
    said = dict(licences_from(["my/demos/=CC-BY-4.0", "walk.csv=own work"], sources))
    assert said == {
        "random:drone": "ovita's own, Apache-2.0",
        "file:demos/a.json": "CC-BY-4.0",
        "file:walk.csv": "own work",
    }
    assert dict(licences_from(["MIT"], sources))["file:walk.csv"] == "MIT"
    assert dict(licences_from([], sources))["file:walk.csv"] == "not stated"
    for wrong, problem in (("demo=MIT", "there is no source 'demo'"), ("=MIT", "say a licence"), ("x=", "say a lice")):
        with pytest.raises(RequestError, match=problem):
            licences_from([wrong], sources)


def test_an_overview_and_a_sheet(data, tmp_path):
    done = ovita("augment", "inspect", str(data), "--samples", "2", "--plot", str(tmp_path / "sheet.png"))
    manifest = open_manifest(data)
    assert done.returncode == 0 and f"{manifest['kept']} samples of 30 numbers, seed 0" in done.stdout
    for word in ("Family", "Split", "Magnitude", "Draws that were rejected", "Some samples"):
        assert word in done.stdout
    assert (tmp_path / "sheet.png").read_bytes().startswith(b"\x89PNG")
    chosen = [sample.index for sample in samples_from_all_over(data, manifest, 5)]
    assert len(set(chosen)) == 5 and chosen == sorted(chosen) and chosen[0] < 8 <= chosen[1] and chosen[-1] >= 24
    printed = json.loads(ovita("augment", "inspect", str(data), "--json").stdout)
    assert printed == manifest


def test_a_sample_opens_as_a_result(data, tmp_path):
    manifest = open_manifest(data)
    sample = samples_from_all_over(data, manifest, 3)[1]
    file = tmp_path / "result.json"
    done = ovita("augment", "inspect", str(data), "--sample", str(sample.index), "--out", str(file))
    assert (
        done.returncode == 0 and "gives the recorded motion" in done.stdout and "judged anew it passes" in done.stdout
    )
    result = Adaptation.load(str(file))
    assert result.instruction == sample.instruction and result.adapted == sample.adapted
    assert result.status in ("done", "limited") and result.constraints is not None
    printed = json.loads(ovita("augment", "inspect", str(data), "--sample", str(sample.index), "--json").stdout)
    assert printed == sample_at(data, manifest, sample.index).to_dict()


@pytest.mark.parametrize(
    "args, problem",
    [
        (["--sample", "30"], "there is no sample 30; they are numbered from 0 to 29"),
        (["--out", "r.json"], "--out writes one sample; say which"),
        (["--plot", "a.gif"], "figures are written as .png"),
    ],
)
def test_misuse_is_one_sentence(data, args, problem):
    done = ovita("augment", "inspect", str(data), *args)
    assert done.returncode == 2 and problem in done.stderr and "Traceback" not in done.stderr


def test_what_is_no_finished_dataset_is_said(tmp_path):
    done = ovita("augment", "inspect", str(tmp_path))
    assert done.returncode == 2 and "holds no augmented dataset" in done.stderr
    (tmp_path / "job.json").write_text("{}")
    assert "is not finished; run the same ovita augment again" in ovita("augment", "inspect", str(tmp_path)).stderr
    (tmp_path / "manifest.json").write_text("{}")
    assert "is no manifest of ovita augment" in ovita("augment", "inspect", str(tmp_path)).stderr


def test_verify_finds_what_was_changed(data):
    manifest = open_manifest(data)
    assert verify(data, manifest).sound
    lie = json.loads(json.dumps(manifest))
    lie["files"][0]["sha256"] = "0" * 64
    assert verify(data, lie).damaged == ("README.md",)
    card = (data / "README.md").read_bytes()
    try:
        (data / "README.md").write_bytes(card.replace(b"Apache", b"Gpache"))
        done = ovita("augment", "inspect", str(data), "--verify")
        assert done.returncode == 4 and "1 damaged or missing: README.md" in done.stdout
    finally:
        (data / "README.md").write_bytes(card)
    done = ovita("augment", "inspect", str(data), "--verify")
    assert done.returncode == 0 and "each passes its own check" in done.stdout and "no scene is in two" in done.stdout


def test_verify_judges_every_sample(data, monkeypatch):
    from ovita.augment.shards import AugmentedSample

    monkeypatch.setattr(AugmentedSample, "holds", lambda self: self.index != 3)
    found = verify(data, open_manifest(data))
    assert found.failed == (3,) and "1 do not pass their check: 3" in " ".join(found.sentences())
