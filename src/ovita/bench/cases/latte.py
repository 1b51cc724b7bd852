"""The LaTTe subset: one clause each, about a distance, a speed near an object, or a direction."""

from __future__ import annotations

from ovita.bench.cases.case import Case, case
from ovita.measure.predicates import (
    Check,
    any_of,
    closer,
    farther,
    faster,
    goal_moved,
    moved,
    near,
    same_path,
    slower,
)
from ovita.measure.predicates.distance import Amount


def _closer(number: int, name: str, amount: Amount | None = None) -> Case:
    return _case(number, "distance", closer(name, amount=amount))


def _farther(number: int, name: str, amount: Amount | None = None) -> Case:
    return _case(number, "distance", farther(name, amount=amount))


def _slower(number: int, name: str, amount: Amount | None = None) -> Case:
    return _case(number, "speed", slower(where=near(name), amount=amount, only=True), same_path())


def _faster(number: int, name: str, amount: Amount | None = None) -> Case:
    return _case(number, "speed", faster(where=near(name), amount=amount, only=True), same_path())


def _toward(number: int, word: str) -> Case:
    """The path shifts, or its goal alone does, be it by going on."""
    return _case(number, "cartesian", any_of(moved(word), goal_moved(word)))


def _case(number: int, kind: str, *checks: Check) -> Case:
    return case(f"latte_subset/latte_{number}", "latte", kind, *checks)


CASES: tuple[Case, ...] = (
    _closer(0, "labyrinth", "much"),
    _slower(1, "orang", "little"),
    _toward(3, "down"),
    _faster(6, "shopping basket", "much"),
    _farther(9, "cardoon"),
    _slower(10, "damselfly", "much"),
    _farther(14, "pretzel", "much"),
    _toward(15, "up"),
    _faster(16, "Irish water spaniel", "much"),
    _closer(19, "bagel", "little"),
    _farther(22, "mower", "little"),
    _toward(23, "left"),
    _slower(25, "space shuttle", "little"),
    _closer(27, "crossword"),
    _toward(30, "down"),
    _toward(32, "left"),
    _slower(33, "icecream", "much"),
    _closer(35, "panda", "little"),
    _toward(36, "down"),
    _closer(38, "Siamese cat"),
    _closer(41, "stoplight", "little"),
    _faster(43, "half track", "much"),
    _closer(45, "trifle", "much"),
    _farther(48, "Tringa totanus"),
    _closer(50, "marmoset", "much"),
    _toward(51, "front"),
    _faster(52, "ladybird beetle"),
    _faster(56, "prairie wolf", "much"),
    _toward(57, "left"),
    _farther(59, "fiddler crab"),
    _faster(62, "African chameleon", "much"),
    _closer(63, "terrace", "little"),
    _closer(65, "Gordon setter"),
    _toward(67, "up"),
    _closer(68, "shako"),
    _faster(70, "confectionery"),
    _farther(74, "curly-coated retriever", "much"),
)
