"""The corpus of many voices is written in the notation that its readme describes."""

import subprocess
import sys
from pathlib import Path

CHECK = Path(__file__).parents[1] / "training" / "corpus" / "check.py"


def test_every_line_of_the_corpus_is_in_the_notation():
    checked = subprocess.run([sys.executable, str(CHECK)], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout[-2000:]
