"""Feedback resolved offline: sentences by what they do to the path, what they are taken to mean, what is none."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dialogue.feedback_sentences import FOURTH, ROWS, SECOND, THIRD
from ovita.dialogue.session import Session
from ovita.errors import OvitaError
from ovita.instruct.editing import apply
from ovita.instruct.frames import Quantity
from ovita.instruct.notation import parse as frames_of
from ovita.instruct.understanding import feedback
from ovita.io import load_task
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.writers.base import Reply, WriterInfo

N = 41
PATH = Trajectory.from_array(np.column_stack([np.zeros(N), np.linspace(0, 2, N), np.full(N, 0.3), np.full(N, 0.4)]))
CUP, TABLE, BOTTLE = [0.4, 0.5, 0.3], [-0.6, 1.0, 0.3], [0.4, 1.5, 0.3]
SCENE = Scene((SceneObject("cup", CUP), SceneObject("table", TABLE), SceneObject("bottle", BOTTLE)))
CUPS = Scene((SceneObject("red cup", CUP), SceneObject("table", TABLE), SceneObject("blue cup", BOTTLE)))


@cache
def after(first):
    """The session after the first turns; only drafts of it are used."""
    session = Session(PATH, CUPS if any("red cup" in said for said in first) else SCENE, writer="builtin")
    for said in first:
        result = session.say(said)
        assert result.usable or (session.pending is not None and session.say("yes").usable), said
    return session


def measured(trajectory):
    p, v = trajectory.positions, trajectory.speeds / 0.4
    gaps = {
        name: float(np.linalg.norm(p - at, axis=1).min())
        for name, at in zip("cup table bottle".split(), OBJECTS, strict=True)
    }
    return {
        **{f"gap_{name}": gap for name, gap in gaps.items()},
        "left": -p[0, 0],
        "left_mid": -p[len(p) // 2, 0],
        "left_end": -p[-1, 0],
        "up": p[0, 2] - 0.3,
        "up_end": p[-1, 2] - 0.3,
        "front": p[0, 1],
        "speed": v[0],
        "speed_end": v[-1],
        "points": len(p),
        **{f"at_{name}": v[min(i, len(v) - 1)] for name, i in (("cup", 10), ("table", 20), ("bottle", 30))},
        "beyond": p[-1, 1] - 2,
        "wide": float(np.ptp(p[:, 0])) / 2,
    }


OBJECTS = (CUP, TABLE, BOTTLE)


SAID = [*ROWS, *SECOND, *THIRD, *FOURTH]


@pytest.mark.parametrize(("first", "said", "wanted"), SAID, ids=[f"{' ; '.join(f)} -> {s}" for f, s, _ in SAID])
def test_what_people_say(first, said, wanted):
    session = after(tuple(first)).draft()
    result = session.say(said)
    assert result.status == wanted["status"] if "status" in wanted else result.usable, result.message
    found = measured(session.current)
    for measure, value in wanted.items():
        if measure != "status":
            low, high = value if isinstance(value, tuple) else (value - 0.005, value + 0.005)
            assert low - 1e-9 <= found[measure] <= high + 1e-9, (measure, found[measure], result.assumptions)


def read(said, before, scene=SCENE):
    """Feedback on frames in the notation."""
    frames = frames_of(before, scene.names)
    return feedback(said, scene, frames, PATH.positions)


def edited(said, before, **values):
    """The amounts of the first frame after feedback, by slot."""
    frames = frames_of(before, SCENE.names)
    after = apply(read(said, before).edits, frames, SCENE, {f"0.{slot}": q for slot, q in values.items()})
    return {slot: q.value for slot, q in after[0].quantities.items()}


def test_it_says_what_it_took_the_words_to_mean():
    assert after(("go left by 0.2",)).draft().say("a bit more").taken == (
        "took 'a bit more' as: left 0.2 m -> 0.25 m (shift to the left)"
    )
    assert "bottle" in after(("slow down near the cup",)).draft().say("I meant the bottle").taken
    session = after(("go left by 0.2",)).draft()
    result = session.say("make it 0.3")
    assert result.taken.startswith("took 'make it 0.3' as: left 0.2 m -> 0.3 m")
    assert result.explanation.startswith("Took 'make it 0.3' as")
    assert session.say("perfect").message == "Took 'perfect' as: it is right as it is; nothing is changed."
    assert [step.said for step in session.steps] == ["go left by 0.2", "make it 0.3"]


def test_a_bit_more_is_not_done_on_top_of_the_whole_turn():
    session = after(("go left by 0.2",)).draft()
    result = session.say("a bit more")
    assert session.current.positions[0, 0] == pytest.approx(-0.25)
    assert result.original == PATH and session.steps[-1].kind == "knobs"
    result = session.say("go left by 0.05")
    assert session.current.positions[0, 0] == pytest.approx(-0.3)


def test_a_question_names_the_knobs_and_takes_an_answer():
    session = after(("go left by 0.2 and slow down near the cup",)).draft()
    asked = session.say("a bit more")
    assert asked.status == "needs_clarification" and "left" in asked.question and "slowdown" in asked.question
    session.say("the shift")
    assert session.current.positions[0, 0] == pytest.approx(-0.25)
    again = after(("go left by 0.2 and slow down near the cup",)).draft()
    again.say("a bit more")
    again.say("go up by 0.1")
    assert again.current.positions[0] == pytest.approx([-0.2, 0, 0.4])


def test_of_two_objects_that_could_be_the_other_one_none_is_chosen():
    scene = Scene((*CUPS.objects, SceneObject("green cup", [0.4, 1.0, 0.3])))
    found = read("the other cup", "pace slower @near=red_cup", scene)
    assert found is None or not found.edits


def test_the_answer_to_which_object_completes_the_instruction():
    session = Session(PATH, CUPS, writer="builtin")
    assert session.say("slow down near the cup").status == "needs_clarification"
    assert session.say("the blue one").usable
    assert session.current.speeds[[10, 30]] == pytest.approx([0.4, 0.2])


def test_the_answer_to_which_of_a_sort_or_to_what_completes_the_instruction():
    objects = (SceneObject("buffalo", [-0.4, 0.5, 0.3]), SceneObject("ridgeback", [0.4, 1.5, 0.3]))
    session = Session(PATH, Scene(objects), writer="builtin")
    assert session.say("slow down near the animal").status == "needs_clarification"
    assert session.say("the buffalo").usable
    assert (session.current.speeds < 0.25).any()
    session = Session(PATH, Scene(objects), writer="builtin")
    assert session.say("keep clear of the thing").status == "needs_clarification"
    assert session.say("the ridgeback").usable


def test_what_is_near_moves_along_with_the_shift():
    session = after(("go left by 0.2 and slow down near the cup",)).draft()
    session.say("make the shift 0.5")
    assert session.current.speeds[10] == pytest.approx(0.2)


def test_original_keeps_the_knobs_as_they_were_turned_and_the_words_as_they_were_meant():
    session = after(("go left by 0.2",)).draft()
    session.say("a bit more")
    session.say("slow down near the cup")
    session.say("no, near the bottle")
    result = session.say("go up by 0.1", on="original")
    assert "bottle" in result.instruction and result.instruction.endswith("go up by 0.1")
    assert result.original == PATH
    assert session.current.positions[0] == pytest.approx([-0.25, 0, 0.4])
    assert session.current.speeds[[10, 30]] == pytest.approx([0.4, 0.2])


def test_undo_redo_and_starting_over_keep_what_was_left():
    session = after(("go left by 0.2", "go up by 0.1")).draft()
    session.say("undo that")
    assert session.say("redo").status == "done" and len(session.steps) == 2
    session.say("start over")
    assert session.steps == () and session.current == PATH
    assert session.say("bring it back").status == "done" and len(session.steps) == 1
    assert session.say("bring it back").status == "done" and len(session.steps) == 2
    assert "nothing to bring back" in session.say("redo").message


def test_feedback_to_a_draft_is_adopted():
    session = after(("go left by 0.2",)).draft()
    draft = session.draft()
    draft.say("undo that")
    session.adopt(draft)
    assert session.steps == ()


@pytest.mark.parametrize("said", ["someplace near the bottle only", "only somewhere in the second half"])
def test_a_vague_restriction_of_the_turn_before_is_not_a_new_instruction(said):
    session = after(("lift the path by 0.1",)).draft()
    result = session.say(said)
    assert result.status == "not_understood" and result.proposal is None and "'some" in result.message
    assert session.current.positions[0, 2] == pytest.approx(0.4)


def test_without_a_turn_before_it_nothing_is_feedback():
    session = Session(PATH, SCENE, writer="builtin")
    assert session.say("a bit more").status in ("not_understood", "needs_clarification")


# Policies of other writers: only names, units and meanings of their knobs are known.

WRITTEN = '''def adapt(
    traj,
    scene,
    *,
    lateral_offset=0.2,  # [m] shift to the left
    cup_speed_factor=0.5,  # factor on the speed near the cup
    influence_radius=0.5,  # [m] distance that counts as near
):
    """Shift left and slow down near the cup."""
    cup = scene["cup"]
    traj = move(traj, left=lateral_offset)
    return scale_speed(traj, cup_speed_factor, where=near(traj, cup, within=influence_radius + lateral_offset))
'''


class Model:
    """A language model that always writes the same policy, and counts how often it was asked."""

    name = "openai:scripted"

    def __init__(self, code=WRITTEN):
        self.code = code
        self.prompts = []

    def write(self, prompt):
        self.prompts.append(prompt)
        return Reply("policy", ("Shift left, slow down.",), self.code, writer=WriterInfo("llm", "scripted"))


OF_A_MODEL = [
    ("a bit more to the left", {"left": 0.25, "at_cup": 0.5}),
    ("slower still", {"left": 0.2, "at_cup": (0.2, 0.45)}),
    ("not so slow", {"left": 0.2, "at_cup": (0.6, 0.8)}),
    ("shift it a bit less", {"left": 0.16, "at_cup": 0.5}),
    ("0.4 instead of 0.2", {"left": 0.4, "at_cup": 0.5}),
    ("make the offset 0.3", {"left": 0.3, "at_cup": 0.5}),
    ("undo the speed", {"left": 0.2, "at_cup": 1.0}),
    ("forget the shift", {"left": 0.0, "at_cup": 0.5}),
    ("set the influence radius to 1.2", {"left": 0.2, "at_bottle": 0.5}),
    ("again", {"left": 0.4}),
    ("undo that", {"left": 0.0, "at_cup": 1.0}),
    ("great", {"left": 0.2, "at_cup": 0.5}),
    ("the other direction", {"left": -0.2}),
]


@pytest.mark.parametrize(("said", "wanted"), OF_A_MODEL, ids=[s for s, _ in OF_A_MODEL])
def test_knobs_of_a_language_models_policy(said, wanted):
    model = Model()
    session = Session(PATH, SCENE, writer=model)
    session.say("a sentence that only a model understands")
    assert session.say(said).status == "done"
    assert len(model.prompts) == 1, "a writer was asked"
    found = measured(session.current)
    for measure, value in wanted.items():
        low, high = value if isinstance(value, tuple) else (value - 0.005, value + 0.005)
        assert low <= found[measure] <= high, (measure, found[measure])


def test_other_words_are_left_to_a_language_model_that_sees_the_last_turns():
    model = Model()
    session = Session(PATH, SCENE, writer=model)
    session.say("slow down near the cup")
    session.say("make the offset 0.3")
    session.say("no, only near the bottle")
    seen = model.prompts[-1].situation
    assert "no, only near the bottle" in seen and "slow down near the cup" in seen
    assert "lateral_offset=0.3" in seen and "lateral_offset=0.2" not in seen
    session.say("and something new")
    session.say("and something else")
    assert model.prompts[-1].situation.count("lateral_offset=") == 2


# What is no feedback.


def test_most_paraphrases_of_instructions_are_no_feedback():
    """A fifth may be: "raise the tempo" after a path was made faster asks for more of it as well."""
    lines = (Path(__file__).parents[1] / "instruct" / "paraphrases.txt").read_text(encoding="utf-8").splitlines()
    sentences = [line for line in lines if line.strip() and line[0] not in "#="][::2]
    past = "move left=0.2m; closer cup by=0.1m; pace faster @near=bottle"
    found = {sentence: read(sentence, past) for sentence in sentences}
    taken = {sentence: reading.edits for sentence, reading in found.items() if reading is not None}
    assert len(taken) <= 0.2 * len(sentences), taken


DEVELOPMENT = Path(__file__).parents[3] / "shared" / "data" / "ovita-dev"


@pytest.mark.skipif(not DEVELOPMENT.is_dir(), reason="the development half of the public data is not here")
def test_nearly_no_instructions_of_the_public_data_are_feedback():
    taken = []
    for file in sorted(DEVELOPMENT.rglob("*.json")):
        try:
            task = load_task(str(file))
        except OvitaError:
            continue
        past = f"move left=0.2m; pace slower @near={(task.scene.names or ('cup',))[0].replace(' ', '_')}"
        taken += [file.name] * (read(task.instruction, past, task.scene) is not None)
    assert len(taken) <= 7, taken  # of 114


# Properties.

metres = st.floats(0.02, 2.0).map(lambda x: float(f"{x:.3g}"))


@settings(max_examples=25, deadline=None)
@given(metres)
def test_more_is_more_and_less_takes_it_back(value):
    for more, less, k in (("a bit more", "a bit less", 1.25), ("more", "less", 1.5), ("much more", "much less", 2.0)):
        up = edited(more, f"move left={value}m")["left"]
        assert up == pytest.approx(k * value, rel=0.03)
        assert edited(less, f"move left={up}m")["left"] == pytest.approx(value, rel=0.06)


@settings(max_examples=40, deadline=None)
@given(metres, metres)
def test_a_number_is_taken_exactly(value, wanted):
    assume(0.1 < wanted / value < 20 and wanted != value)
    for said in (f"make it {wanted:g}", f"{wanted:g} instead of {value:g}"):
        assert edited(said, f"move left={value}m")["left"] == pytest.approx(wanted)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.1, 0.9).map(lambda x: round(x, 2)))
def test_a_slowdown_stays_one(value):
    amount = Quantity(value, "x", "to")
    for said in ("a bit more", "slower still", "twice that", "much more"):
        assert 0 < edited(said, "pace slower @near=cup", amount=amount)["amount"] < value
    for said in ("a bit less", "not so slow", "half of that"):
        assert value < edited(said, "pace slower @near=cup", amount=amount)["amount"] < 1


@pytest.mark.parametrize("said", [",", "...", "!?", "-", "reverse it", "step back by 0.1", "go back by 0.1"])
def test_signs_and_instructions_take_nothing_back(said):
    found = read(said, "move left=0.2m")
    assert found is None or not found.edits


def test_a_models_knob_called_a_distance_is_still_known_by_its_direction():
    code = (
        "def adapt(traj, scene, *, distance=0.2):  # distance to shift left [m]\n    return move(traj, left=distance)\n"
    )
    session = Session(PATH, SCENE, writer=Model(code))
    session.say("frobnicate")
    assert session.say("slightly more to the left").parameters[0].value == pytest.approx(0.25)


@pytest.mark.parametrize("said", ["purple monkeys 1", "plus 4 cm"])
def test_a_number_among_words_that_say_nothing_of_the_turn_before_is_not_done(said):
    session = after(("go left by 0.2",)).draft()
    before = session.current
    asked = ("not_understood", "needs_clarification", "needs_confirmation")
    assert session.say(said).status in asked and session.current == before


def test_a_size_of_an_object_is_never_done_at_once():
    session = after(("go left by 0.2",)).draft()
    before = session.current
    assert session.say("the cup is 4 cm tall").status == "needs_confirmation" and session.current == before


@pytest.mark.parametrize(
    "said", ["no, 0.3", "make it 30 cm", "Regulations say 30 cm", "0.3 please, the cat is watching"]
)
def test_a_plain_number_is_taken_at_once(said):
    session = after(("go left by 0.2",)).draft()
    session.say(said)
    assert session.pending is None
    assert np.allclose(session.current.positions - PATH.positions, [-0.3, 0, 0], atol=1e-6)


@pytest.mark.parametrize(
    ("first", "said", "wanted"),
    [
        ("slow down near the cup", "It dawdles now, the speed was all right before, cancel the slowdown", "undo"),
        ("go up by 0.1", "I revoke that last wish of mine", "undo"),
        ("circle the cup with a radius of 10 cm", "A tighter loop, let us say five", "radius"),
        ("go left by 0.2", "oh dear no, put it back where it was to begin with", "undo"),
    ],
)
def test_what_the_rules_read_otherwise_is_left_to_the_network_where_it_is_likelier(first, said, wanted):
    session = after((first,)).draft()
    session.say(said)
    if wanted == "undo":
        assert np.array_equal(session.current.to_array(), PATH.to_array())
    else:
        assert session.adaptation.frames[0].radius.value == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("first", "said"),
    [
        ("slow down", "raise the whole path by 5 cm"),
        ("go left by 0.2", "lift it by 0.1 near the bottle"),
    ],
)
def test_a_further_instruction_is_no_feedback_on_the_turn_before(first, said):
    session = after((first,)).draft()
    before = session.current
    assert session.say(said).usable and len(session.steps) == 2
    assert session.current.positions[-1, 2] >= before.positions[-1, 2]
    assert np.allclose(session.current.positions[:, 0], before.positions[:, 0], atol=1e-6)


@pytest.mark.parametrize("again", ["once more", "and another round of that please", "repeat it"])
def test_smoothing_again_takes_out_more_bends(again):
    rough = PATH.to_array()
    rough[1:-1, 0] += 0.03 * np.random.default_rng(3).normal(size=N - 2)
    session = Session(Trajectory.from_array(rough), SCENE, writer="builtin")
    assert session.say("smooth the path").usable

    def bends():
        return float((np.diff(session.current.positions, n=2, axis=0) ** 2).sum())

    first = bends()
    assert session.say(again).status == "done" and bends() < 0.9 * first


@pytest.mark.parametrize("wish", ["dance", "sing"])
def test_a_wish_that_no_frame_holds_is_not_passed_over(wish):
    asked = Session(PATH, SCENE, writer="builtin").say(f"go left by 0.05 and {wish}")
    assert asked.status == "needs_confirmation"


@pytest.mark.parametrize("said", ["slow down to 0 near the cup", "slow down to zero near the cup"])
def test_a_speed_of_zero_in_a_part_is_asked_about(said):
    asked = Session(PATH, SCENE, writer="builtin").say(said)
    assert asked.status == "needs_clarification" and "never arrive" in asked.question


@pytest.mark.parametrize("said", ["what changed so far?", "is that fast?", "how long does it take now?"])
def test_a_question_of_fact_changes_nothing(said):
    session = after(("stay 0.15 away from the bottle",)).draft()
    before = session.current
    assert session.say(said).status != "needs_confirmation" and session.current == before


def test_no_takes_one_step_back():
    session = after(("go left by 0.2", "a bit more")).draft()
    first = session.history.after(session.history.path()[0])
    assert session.say("no").usable and session.current == first


@pytest.mark.parametrize(
    ("said", "up"), [("no, not so much, two is enough", 0.02), ("make it 4", 0.04), ("make it 0.05", 0.05)]
)
def test_a_bare_number_is_in_the_unit_that_was_said(said, up):
    session = after(("go 3 cm higher",)).draft()
    assert session.say(said).usable
    assert measured(session.current)["up"] == pytest.approx(up)


def test_the_other_half_and_the_other_one():
    session = after(("10 cm higher in the first half",)).draft()
    session.say("no, the other half")
    assert measured(session.current)["up"] == pytest.approx(0.0)
    assert measured(session.current)["up_end"] == pytest.approx(0.1)
    session = after(("slow down near the red cup",)).draft()
    session.say("the other one as well")
    assert measured(session.current)["at_cup"] < 0.6 and measured(session.current)["at_bottle"] < 0.6  # the blue cup


@pytest.mark.parametrize("said", ["ok, not quite that much", "hmm, something in between"])
def test_a_correction_goes_back_no_further_than_the_last_one(said):
    session = after(("go 10 cm higher", "a bit more")).draft()
    high = measured(session.current)["up"]
    assert session.say(said).usable
    assert 0.1 < measured(session.current)["up"] < high


def test_what_gives_up_more_than_it_names_is_asked_or_gives_up_what_it_names():
    session = after(("slow down near the cup", "the same near the bottle")).draft()
    session.say("hmm, the bottle is overkill actually, leave that as it was")
    assert measured(session.current)["at_cup"] < 0.6 and measured(session.current)["at_bottle"] == pytest.approx(1.0)
    session = after(("go left by 0.2", "slow down near the cup")).draft()
    before = session.current
    result = session.say("no, I don't like the shift after all, back to how it went before but keep the slower bit")
    assert result.status == "needs_clarification" and session.current == before
