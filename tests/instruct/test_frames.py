"""When two lists of frames mean the same."""

import pytest

from ovita.instruct.meaning import same
from ovita.instruct.notation import parse

OBJECTS = ("cup", "box")


@pytest.mark.parametrize(
    ("one", "other", "equal"),
    [
        ("farther cup+box by=10cm", "farther box by=10cm; farther cup by=10cm", True),
        ("move left=5cm up", "move up; move left=5cm", True),
        ("keep ends", "keep goal; keep start", True),
        ("move y=-5cm", "move -y=5cm", True),
        ("move left=5cm up=5cm", "move left=5cm", False),
        ("farther cup+box", "farther cup", False),
        ("via between=cup+box", "via cup; via box", False),
        ("keep ends", "keep goal", False),
        ("circle cup turns=1", "circle cup", True),
        ("circle cup turns=2", "circle cup", False),
        ("wait at=50% for=2s", "wait at=middle for=2s", True),
    ],
)
def test_same(one, other, equal):
    assert same(parse(one, OBJECTS), parse(other, OBJECTS)) is equal
