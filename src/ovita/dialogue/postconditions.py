"""Postconditions over a conversation: what earlier turns promised is measured again after every later one.

Only what a later turn can lose by accident stays in force: distances, sides, places passed, ends, speeds and their
bounds; and for an edit by hand, which says nothing, also how far the path was to move. A turn that promises something
of its own about the same object, end or speed replaces what was in force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.paths.correspondence import correspond
from ovita.paths.scene import OPPOSITE, Scene
from ovita.paths.trajectory import Trajectory
from ovita.policy.reading import parse
from ovita.result import Adaptation, LostPostcondition, Postcondition
from ovita.toolkit import Expectation, Outcome, judge

KEEP_IT = ("yes", "yes please", "yes, please", "keep it", "yes, keep it", "yes keep it", "please keep it", "keep that")
"""Answers that ask for a lost postcondition to hold again."""

_YES = (
    "yes", "yes please", "yep", "yup", "yeah", "y", "sure", "ok", "okay", "alright", "all right", "correct",
    "exactly", "do it", "do that", "do this", "go ahead", "go for it", "please do", "accept", "confirmed", "confirm",
    "that is right", "that's right", "that is it", "that's it", "fine", "agreed", "affirmative",
)  # fmt: skip
NOT_THAT = ("no", "nope", "nah", "n", "wrong", "not that", "not this", "negative", "that is wrong", "that's wrong")
"""Answers that refuse a reading, after which another one may be meant; others end the matter."""

_NO = (
    *NOT_THAT, "no thanks", "no thank you", "don't", "do not", "never mind", "nevermind", "forget it", "forget that",
    "cancel", "cancel that", "undo", "undo that", "undo it", "take that back", "take it back", "leave it", "no way",
)  # fmt: skip
_GOES_ON = ("but", "only", "just", "make", "rather", "and", "it", "the", "not", "i", "with", "please")
_BETWEEN = " ,.!;:-"


def answered(said: str) -> tuple[bool | None, str]:
    """Whether an utterance agrees to a proposal (None: it does neither), and what it says beyond that.

    "yes" gives (True, ""), "no, 10 cm" (False, "10 cm"), "10 cm" (None, "10 cm"). Only a yes or no that a comma or the
    end follows counts, so that "right by 10 cm" is no agreement.
    """
    text = said.strip().strip(_BETWEEN)
    plain = text.lower().replace("\u2019", "'")
    polite = len(plain.removesuffix("please").rstrip(_BETWEEN)) or len(plain)
    plain, text = plain[:polite], text[:polite]
    for words, agrees in ((_YES, True), (_NO, False)):
        for word in sorted(words, key=len, reverse=True):
            after = plain[len(word) :]
            if plain == word or (plain.startswith(word) and after.lstrip(" ")[:1] in (",", ".", "!", ";", ":", "-")):
                return agrees, text[len(word) :].strip(_BETWEEN)
    first, _, rest = text.partition(" ")
    second = rest.lower().partition(" ")[0]
    if first.lower() in ("no", "nope", "yes", "yeah", "yep") and (second[:1].isdigit() or second in _GOES_ON):
        return first.lower()[0] == "y", rest.strip(_BETWEEN)
    return None, text


_SUBJECTS = {
    **dict.fromkeys(("closer", "farther", "distance", "visits"), "place"),
    **dict.fromkeys(("slower", "faster", "speed", "duration", "stop"), "speed"),
    "start": "start",
    "goal": "goal",
}
_AMOUNTS, _LEFT = ("moved", "length"), 0.5
"""What an edit by hand wipes out where less than this share of it is left."""
_END = "def adapt(traj, scene):\n    expect_{end}({at})\n    return move_{end}(traj, {at})\n"


@dataclass(frozen=True)
class Loss:
    """A postcondition that a later turn lost.

    Args:
        turn: The result that made it hold.
        postcondition: What it promised.
        report: The loss in words, as the later result carries it.
    """

    turn: Adaptation
    postcondition: Postcondition
    report: LostPostcondition

    def restoring(self, current: Trajectory) -> Adaptation:
        """A result whose policy restores it on `current` when rerun."""
        promise = self.postcondition
        asked = replace(self.turn, original=current, taken="")
        if promise.kind not in ("start", "goal") or promise.arguments:
            return asked
        row = 0 if promise.kind == "start" else -1
        point = [float(value) for value in self.turn.adapted.positions[row]]
        policy = parse(_END.format(end=promise.kind, at=point))
        plan = (f"Bring the {promise.kind} back to where it was asked to stay.",)
        return replace(asked, code=policy.source, parameters=policy.parameters, plan=plan, assumptions=())


def lost(
    turns: Sequence[Adaptation],
    before: Trajectory,
    result: Adaptation,
    *,
    scene: Scene | None = None,
    afresh: Sequence[Adaptation] | None = None,
    by_hand: bool = False,
) -> list[Loss]:
    """The postconditions in force that held before a result and no longer do.

    Args:
        turns: The earlier turns in force, oldest first, without the one that the result is a correction of.
        before: The trajectory before the result.
        result: The new result.
        scene: The scene before the result, where objects have been moved since.
        afresh: The same turns, run again in the new situation; their originals and places count from now on.
        by_hand: Whether the result is an edit by hand.
    """
    found: list[Loss] = []
    settled = {"", *(_subject(promise, by_hand) for promise in result.postconditions)}
    pairs = list(zip(turns, turns if afresh is None else afresh, strict=True))
    for ago, (turn, again) in enumerate(reversed(pairs), start=1):
        both = zip(turn.postconditions, again.postconditions, strict=False)
        mine = {_subject(was, by_hand): (was, now) for was, now in both if was.held and was.kind == now.kind}
        for was, now in [pair for subject, pair in mine.items() if subject not in settled]:
            if not _holds(was, turn, before, scene or result.scene, by_hand)[0]:
                continue
            held, outcome = _holds(now, again, result.adapted, result.scene, by_hand)
            if not held:
                report = LostPostcondition(now.text, outcome.sentence, turn.instruction, ago)
                found.append(Loss(again, now, report))
        settled |= set(mine)
    return found[::-1]


def _holds(
    promise: Postcondition, turn: Adaptation, trajectory: Trajectory, scene: Scene, by_hand: bool
) -> tuple[bool, Outcome]:
    """Whether a turn's promise holds on a trajectory, of an amount most of it, and what was measured."""
    where = promise.arguments.get("where", {})
    if by_hand and where.get("count") == len(turn.original):
        kept = correspond(turn.original.positions, trajectory.positions).kept
        part = np.concatenate([kept[first : last + 1] for first, last in where["ranges"]] or [kept])
        if part.mean() < _LEFT:
            return False, Outcome(False, f"{part.sum()} of {len(part)} waypoints of that part are left")
    expectation = Expectation(promise.kind, promise.arguments, promise.text)
    found = judge(expectation, turn.original.to_array(), trajectory.to_array(), scene)
    most = promise.kind in _AMOUNTS and found.change is not None and found.change >= _LEFT * (promise.change or 0.0)
    return found.held or most, found


def _subject(promise: Postcondition, by_hand: bool) -> str:
    """What a postcondition is about, or "" if it does not stay in force."""
    if by_hand and promise.kind in _AMOUNTS:
        return f"{promise.kind} {promise.arguments}"
    subject, about = _SUBJECTS.get(promise.kind, ""), promise.arguments
    if promise.kind == "side":
        subject = f"side {min(about['side'], OPPOSITE[about['side']])}"
    elif promise.kind == "speed":
        bounds = [name for name in ("at_least", "at_most") if name in about]
        return f"speed {bounds}" if bounds else subject
    elif subject != "place":
        return subject
    return f"{subject} {about.get('object') or about.get('point')}"
