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


BESIDES = """# scene: door, cup
slow by the door and beep | pace slower @near=door; ! unrelated
beep | ! unrelated
"""
READ = """
import sys, pathlib, check
print([(e.outcome, e.besides, len(e.frames)) for e in check.examples(pathlib.Path(sys.argv[1]))])
"""


def test_a_wish_that_no_frame_can_say_stands_behind_the_others(tmp_path):
    voice = tmp_path / "porter.txt"
    voice.write_text(BESIDES)
    told = [sys.executable, "-c", READ, str(voice)]
    read = subprocess.run(told, capture_output=True, text=True, check=True, cwd=CHECK.parent)
    assert read.stdout.strip() == "[('do', 'unrelated', 1), ('improper', '', 0)]"
