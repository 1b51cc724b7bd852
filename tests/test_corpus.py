"""The corpus of many voices is written in the notation that its readme describes."""

import subprocess
import sys
from pathlib import Path

CHECK = Path(__file__).parents[1] / "training" / "corpus" / "check.py"


def test_every_line_of_the_corpus_is_in_the_notation():
    checked = subprocess.run([sys.executable, str(CHECK)], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout[-2000:]


SAID = """# scene: cup
go left and smooth it | move left; smooth
smooth it | smooth
go left | move left
go up | move up
go up, then smooth it | smooth; move up
smooth it, then go 2 cm up and wait | wait; move up=2cm; smooth
wait | wait
"""
ORDER = """
import sys, pathlib, augment, order
samples = list(augment.samples(pathlib.Path(sys.argv[1]), frozenset()))
made = order.Order(samples)
print([[atom.label("action") for atom in made.ordered(sample).atoms] for sample in samples if len(sample.atoms) > 1])
"""


def test_wishes_of_a_drawn_reading_are_put_in_the_order_in_which_they_are_said(tmp_path):
    voice = tmp_path / "voice.txt"
    voice.write_text(SAID)
    run = subprocess.run(
        [sys.executable, "-c", ORDER, voice], cwd=CHECK.parents[1], capture_output=True, text=True, check=False
    )
    assert run.stdout.strip() == "[['move', 'smooth'], ['move', 'smooth'], ['smooth', 'move', 'wait']]", run.stderr
