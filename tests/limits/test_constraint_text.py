"""Reading constraint texts: what is understood, in which numbers, and what is handed back."""

import math

import pytest

from ovita.errors import RobotError
from ovita.limits import parse_text
from ovita.paths.robot import Robot, Shell

INF = math.inf


@pytest.mark.parametrize(
    ("text", "ranges"),
    [
        ("x -2 to 2, y -3 to 3, z 0 to 2", {"x": (-2, 2), "y": (-3, 3), "z": (0, 2)}),
        ("The x-axis range is -0.5 to 0.5. The y-axis range is -1 to 1.", {"x": (-0.5, 0.5), "y": (-1, 1)}),
        ("x ranges from -4 to 4, and y ranges from -3 to 2.5.", {"x": (-4, 4), "y": (-3, 2.5)}),
        ("a maximum x of 3, a minimum x of -4 and a maximum y of 2", {"x": (-4, 3), "y": (-INF, 2)}),
        ("The z-coordinate is always 0.", {"z": (0, 0)}),
        ("z is fixed at 0.2 m", {"z": (0.2, 0.2)}),
        ("x in [-1, 1]; y between 0 m and 2.5 m", {"x": (-1, 1), "y": (0, 2.5)}),
        ("-2 <= x <= 2 and 0<y<1.5", {"x": (-2, 2), "y": (0, 1.5)}),
        ("z ± 50 cm", {"z": (-0.5, 0.5)}),
        ("X must stay between 10 cm and 80 cm", {"x": (0.1, 0.8)}),
        ("The z-axis is limited to -100 mm to 0.3 m", {"z": (-0.1, 0.3)}),
        ("z > 0", {"z": (0, INF)}),
        ("z >= 0.1", {"z": (0.1, INF)}),
        ("x < 2", {"x": (-INF, 2)}),
        ("z at least 10 cm", {"z": (0.1, INF)}),
        ("0.1 <= z", {"z": (0.1, INF)}),
        ("z must not be above 1.5 m", {"z": (-INF, 1.5)}),
        ("The y-coordinate must stay below 0.4", {"y": (-INF, 0.4)}),
        ("z >= 0.1 and z <= 0.9", {"z": (0.1, 0.9)}),
        ("z must be greater than 0.1 m and less than 1.2 m", {"z": (0.1, 1.2)}),
    ],
)
def test_ranges(text, ranges):
    found = parse_text(text)
    assert found.ranges == {k: pytest.approx(v) for k, v in ranges.items()}
    assert not found.ignored
    assert len(found.understood) == len(ranges)


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("sphere of radius 0.8 ± 0.2 m around the base", "reach", 1.0),
        (
            "A ball with the radius of 0.8 meters around the base.\n Tolerance of +0.2 and -0.2 is allowed.",
            "reach",
            1.0,
        ),
        ("keep 0.1 m from obstacles", "obstacle_margin", 0.1),
        ("Stay at least 10 cm away from all objects.", "obstacle_margin", 0.1),
        ("It must maintain a minimum distance of 0.1 from the borders of all objects.", "obstacle_margin", 0.1),
        ("The maximum speed is 0.5 m/s", "max_speed", 0.5),
        ("v_max = 0.5", "max_speed", 0.5),
        ("max speed 30 cm/s", "max_speed", 0.3),
        ("no faster than 0.4", "max_speed", 0.4),
        ("The speed must never be over 0.35", "max_speed", 0.35),
        ("the top speed is 0.5", "max_speed", 0.5),
        ("must be slower than 0.3 m/s", "max_speed", 0.3),
        ("at most 0.5 m/s", "max_speed", 0.5),
        ("The speed must be above 0.2 m/s", "min_speed", 0.2),
        ("a_max = 2", "max_acceleration", 2.0),
        ("acceleration at most 2", "max_acceleration", 2.0),
        ("no faster than 0.5 m/s", "max_speed", 0.5),
        ("Do not exceed 0.5 m/s", "max_speed", 0.5),
        ("v <= 0.4", "max_speed", 0.4),
        ("The speed is at least 0.1 m/s", "min_speed", 0.1),
        ("no slower than 0.1 m/s", "min_speed", 0.1),
        ("The acceleration is at most 2 m/s^2", "max_acceleration", 2.0),
        ("Keep 0.5 m away from people", "person_margin", 0.5),
        ("reach 0.8 +- 0.2 m", "reach", 1.0),
        ("A reach of 80 ± 20 cm", "reach", 1.0),
    ],
)
def test_single_values(text, key, value):
    found = parse_text(text)
    assert getattr(found, key) == pytest.approx(value)
    assert not found.ignored


def test_what_is_not_understood_is_handed_back():
    found = parse_text("There is a room. x 0 to 1. Never cross the red line. Keep the gripper level.")
    assert found.ranges == {"x": (0, 1)}
    assert found.ignored == ("Never cross the red line", "Keep the gripper level")
    assert parse_text("").understood == ()


def test_bounds_in_two_sentences_hold_together():
    assert parse_text("z >= 0.1. z <= 0.9").ranges == {"z": (0.1, 0.9)}
    with pytest.raises(RobotError, match="exceeds upper"):
        parse_text("z >= 0.5. z <= 0.2").apply(Robot.preset("none"))


@pytest.mark.parametrize(
    "text",
    [
        *("t < 3", "The tilt is at most 5 degrees", "Do not exceed the line", "roll <= 0.2", "Do not exceed 0.4"),
        *("y <= 10 mil", "z at most 80 furlongs", "y >= 3 degrees", "clearance 0.1", "minimum height 0.2"),
    ],
)
def test_limits_of_other_kinds_are_handed_back_by_name(text):
    found = parse_text(text)
    assert found.ignored == (text,) and not found.understood


def test_of_two_limits_the_stricter_one_holds():
    found = parse_text("Speed up to 0.4 m/s. The speed is at most 0.6 and at least 0.1 m/s. v >= 0.05 m/s")
    assert (found.max_speed, found.min_speed) == (0.4, 0.1)


def test_limits_take_the_place_of_the_robots():
    drone = Robot.preset("drone")
    room = parse_text("x -2 to 2, z 0 to 2. Keep 5 cm from obstacles. Speed up to 0.4 m/s.").apply(drone)
    assert room.workspace.lower == (-2, -3, 0)
    assert room.workspace.upper == (2, 3, 2)
    assert (room.obstacle_margin, room.max_speed, room.margin) == (0.05, 0.4, drone.margin)
    flat = parse_text("z is always 0").apply(Robot.preset("ground"))
    assert flat.workspace.lower[2] == -0.01
    assert flat.workspace.upper[2] == 0.01
    arm = parse_text("a sphere of radius 0.9 m").apply(Robot.preset("arm"))
    assert arm.workspace == Shell((-0.5, 0.0, 0.6), 0.15, 0.9)
    assert parse_text("a sphere of radius 0.9 m").apply(drone, base=(1, 2, 3)).workspace == Shell((1, 2, 3), 0.0, 0.9)
    assert parse_text("nothing at all").apply(drone) == drone


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        ("Keep 0.1 m from obstacles and never go near the kitchen.", ("never go near the kitchen",)),
        ("The speed is at most 0.3 m/s and the jerk at most 2", ("the jerk at most 2",)),
        ("the speed is at least 0.1 m/s and the tilt at most 3", ("the tilt at most 3",)),
        ("z >= 0.1, do not touch the cup", ("do not touch the cup",)),
        ("The workspace is x -1 to 1, y -1 to 1, z 0 to 2, all in metres.", ()),
        ("x between 0 and 1, y from -1 to 2, and z is at least 0.1", ()),
    ],
)
def test_a_sentence_that_states_one_limit_and_asks_for_more_hands_the_rest_back(text, rest):
    limits = parse_text(text)
    assert limits.understood and limits.ignored == rest
