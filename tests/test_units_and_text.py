import pytest

from ovita import text, units


@pytest.mark.parametrize(
    ("value", "word", "expected"),
    [
        (5, "cm", (0.05, "m")),
        (2, "Feet", (0.6096, "m")),
        (3, "millimetres", (0.003, "m")),
        (36, "km/h", (10.0, "m/s")),
        (20, "centimeters per second", (0.2, "m/s")),
        (20, "percent", (0.2, "%")),
        (3, "seconds", (3.0, "s")),
        (3, "timesteps", (3.0, "step")),
        (1, "radian", (57.29577951308232, "deg")),
        (2, "m/s^2", (2.0, "m/s2")),
        (10, "in/s", (0.254, "m/s")),
    ],
)
def test_units_come_in_si(value, word, expected):
    found, dimension = units.to_si(value, word)
    assert found == pytest.approx(expected[0], rel=1e-12) and dimension == expected[1]


def test_a_word_that_is_no_unit_is_refused():
    assert units.find("bananas") is None
    with pytest.raises(ValueError, match="'bananas' is no unit"):
        units.to_si(1, "bananas")


def test_every_spelling_means_one_unit():
    spelled = [spelling for unit in units.TABLE for spelling in unit.spellings]
    assert len(spelled) == len(set(spelled))


def test_lists_numbers_and_counts_read_like_a_sentence():
    assert [text.listed("abc"[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    numbers = (0.2, 0.1234, 3.14159, 42.42, 512.3, 0)
    assert [text.number(x) for x in numbers] == "0.20 0.123 3.14 42.4 512 0.00".split()
    assert text.counted(1, "waypoint") == "1 waypoint" and text.counted(3, "axis", "axes") == "3 axes"
    assert text.waypoints(0, 9) == "waypoints 1 to 10" and text.the("The cup") == "The cup"
    assert text.sentence("it stops") == "It stops." and text.shortened("x" * 99, 10) == "'xxxxxx..."
    assert [text.length(x) for x in (0.004, 0.035, 1.2)] == ["4 mm", "3.5 cm", "1.20 m"]
