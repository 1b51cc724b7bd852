"""From tokens to clauses: where one thing to do ends and the next begins."""

from __future__ import annotations

from ovita.language.builtin.tokens import Token

DIRECTIONS = frozenset({"left", "right", "front", "back", "up", "down"})

ACTIONS = DIRECTIONS | {
    "faster",
    "slower",
    "constant",
    "closer",
    "away",
    "stop",
    "wait",
    "extend",
    "smooth",
    "through",
    "over",
    "keep",
    "increase",
    "decrease",
    "double",
    "half",
    "lower",
    "raise",
    "toward",
    "more",
    "fewer",
    *("spiral", "circle", "eight", "zigzag", "wave", "hop", "hover", "mirror", "rotate", "tilt", "resize"),
    *("curvature", "straight", "average", "reverse", "noise", "quadrant", "trapezoid", "exponential", "never"),
}
"""Concepts that ask for something; a piece of a sentence without one belongs to its neighbour."""

SPEED = frozenset({"speed", "faster", "slower", "constant"})
"""Concepts that make a clause one about speed."""

Clause = tuple[Token, ...]


def split(tokens: tuple[Token, ...]) -> list[Clause]:
    """Split a sentence's tokens into clauses at connectives and punctuation.

    A piece that asks for nothing itself ("when passing the cup", the second object of a list) is joined to the
    piece before it, or to the one after it if it comes first.
    """
    pieces = _pieces(tokens)
    clauses: list[Clause] = []
    pending: Clause = ()
    for piece, hard, apart in pieces:
        if _asks(piece) or (hard and clauses and _is_statement(piece)):
            clauses.append(pending + piece)
            pending = ()
        elif clauses and not pending and not (apart or _bare_endpoint(piece)):
            clauses[-1] = clauses[-1] + piece
        elif clauses and not pending:
            clauses.append(piece)
        else:
            pending = pending + piece
    if pending:
        clauses.append(pending)
    return [_settled(c) for c in clauses]


def _pieces(tokens: tuple[Token, ...]) -> list[tuple[Clause, bool, bool]]:
    """Pieces between separators; the flags say that a full stop or semicolon, or a "but", precedes the piece."""
    pieces: list[tuple[Clause, bool, bool]] = []
    current: list[Token] = []
    hard = apart = False
    for i, token in enumerate(tokens):
        separates = token.kind == "break" or (token.kind == "join" and not _lists_objects(tokens, i))
        separates = separates or (token.text.lower() == "while" and _about_speed(tokens[i + 1 :]))
        if token.value == "but" and i > 0 and tokens[i - 1].value == "whole":
            current.append(Token("unknown", token.text))  # "everything but the goal"
            continue
        if not separates:
            if token.kind != "join":
                current.append(token)
            continue
        if any(t.kind != "filler" for t in current):
            pieces.append((tuple(current), hard, apart))
            hard = apart = False
        current = []
        hard = hard or token.value in ".;"
        apart = apart or token.value == "but"
    if any(t.kind != "filler" for t in current):
        pieces.append((tuple(current), hard, apart))
    return pieces


def _lists_objects(tokens: tuple[Token, ...], i: int) -> bool:
    """Whether the connective at i joins two objects: "the cup and the plate"."""
    before = next((t for t in reversed(tokens[:i]) if t.kind != "filler"), None)
    after = next((t for t in tokens[i + 1 :] if t.kind != "filler"), None)
    return before is not None and after is not None and before.kind == "object" == after.kind


def _about_speed(rest: Clause) -> bool:
    """Whether what follows "while", up to the next mark, changes the speed rather than naming a part of the path."""
    until = next((i for i, t in enumerate(rest) if t.kind in ("break", "join")), len(rest))
    return any(t.value in SPEED or t.unit == "m/s" for t in rest[:until])


def _asks(piece: Clause) -> bool:
    concepts = {t.value for t in piece if t.kind == "concept"}
    if concepts & ACTIONS:
        conditional = next((t for t in piece if t.kind != "filler"), None)
        alone = concepts & (ACTIONS - DIRECTIONS)
        return not (
            conditional is not None
            and conditional.value in ("when", "after", "before")
            and not alone
            and not any(t.kind == "number" for t in piece)
            and len([t for t in piece if t.kind != "filler"]) <= 3
        )
    if {"after", "goal"} <= concepts:
        return any(t.kind != "filler" and t.value not in ("after", "goal", "reach") for t in piece)
    endpoint = bool(concepts & {"start", "goal"})
    if any(t.unit == "m/s" for t in piece):
        return True
    return (endpoint and (any(t.kind == "object" for t in piece) or "between" in concepts)) or (
        "speed" in concepts and any(t.kind == "number" for t in piece)
    )


def _bare_endpoint(piece: Clause) -> bool:
    """A bare "and end there", which is no part of the clause before it."""
    concepts = {t.value for t in piece if t.kind == "concept"}
    related = concepts & {"near", "when", "reach", "before", "after", "within", "toward", "between"}
    return bool(concepts & {"start", "goal"}) and not related


def _is_statement(piece: Clause) -> bool:
    """A sentence of its own that only states a number, such as "Threshold is 0.3"."""
    return any(t.value == "threshold" for t in piece) and any(t.kind == "number" for t in piece)


def _settled(clause: Clause) -> Clause:
    """Settle words whose meaning depends on the clause: "lower the speed" against "go lower"."""
    concepts = [t.value for t in clause if t.kind == "concept"]
    about_speed = "speed" in concepts
    settled: list[Token] = []
    for i, token in enumerate(clause):
        value = token.value
        if token.kind == "concept":
            following = next((t.value for t in clause[i + 1 :] if t.kind != "filler"), "")
            if value == "stop" and i + 1 < len(clause) and clause[i + 1].text.lower().split()[0].endswith("ing"):
                settled.append(Token("unknown", token.text))  # "stop slowing down" takes something back
                continue
            if value == "up" and _before_target(clause, i):
                settled.append(Token("filler", token.text))  # "up to 0.4"
                continue
            if value == "decrease" and token.text.lower().startswith("drop") and not about_speed:
                value = "down"
            if value in ("lower", "raise"):
                change = ("decrease", "increase") if about_speed else ("down", "up")
                value = change[value == "raise"]
            elif value == "around" and SPEED & set(concepts):
                value = "near"
            elif value == "between" and not any(t.kind == "object" for t in clause):
                value = "middle"
            elif value in ("up", "down") and following == "speed":
                value = "increase" if value == "up" else "decrease"
        settled.append(token if value == token.value else Token("concept", token.text, value=value))
    if "height" in concepts and set(concepts) & {
        "increase",
        "decrease",
        "more",
        "fewer",
        "up",
        "down",
        "lower",
        "raise",
    }:
        settled = _with_height(settled)
    return tuple(settled)


def _before_target(clause: Clause, i: int) -> bool:
    return i + 2 < len(clause) and clause[i + 1].text.lower() == "to" and clause[i + 2].kind == "number"


def _with_height(clause: list[Token]) -> list[Token]:
    """Turn "increase the altitude" into up; the word height itself says nothing more."""
    turned = {"increase": "up", "decrease": "down", "more": "up", "fewer": "down"}
    return [
        Token("filler", t.text)
        if t.value == "height"
        else Token("concept", t.text, value=turned[t.value])
        if t.kind == "concept" and t.value in turned
        else t
        for t in clause
    ]
