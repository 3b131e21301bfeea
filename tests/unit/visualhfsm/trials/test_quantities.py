"""What varies from trial to trial."""

from __future__ import annotations

import random
import statistics
import tomllib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visualhfsm.trials._quantities import Quantity, Same, Spread, draw_all, read_quantities

NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)


def read(text: str) -> dict[str, Any]:
    return read_quantities(tomllib.loads(text)["scene"], "scene", "plan.toml", text, ValueError)


@given(NUMBERS, NUMBERS, st.integers())
def test_an_even_number_is_within_its_range(one: float, other: float, seed: int) -> None:
    low, high = sorted((one, other))
    assert low <= Spread(lowest=low, highest=high).draw(random.Random(seed)) <= high


@given(NUMBERS, st.floats(0.001, 1000), st.integers())
def test_a_normal_number_stays_within_its_limits(mean: float, deviation: float, seed: int) -> None:
    spread = Spread(mean=mean, deviation=deviation, lowest=mean - 1, highest=mean + 1)
    assert mean - 1 <= spread.draw(random.Random(seed)) <= mean + 1


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.integers())
def test_a_number_even_in_the_logarithm_is_within_its_range(one: float, other: float, seed: int) -> None:
    low, high = sorted((one, other))
    drawn = Spread(lowest=low, highest=high, log=True).draw(random.Random(seed))
    assert low * (1 - 1e-9) <= drawn <= high * (1 + 1e-9)


def test_whole_numbers_include_both_ends() -> None:
    spread = Spread(lowest=1, highest=3, whole=True)
    source = random.Random(0)
    assert {spread.draw(source) for _ in range(100)} == {1, 2, 3}


def test_a_normal_distribution_has_its_mean_and_its_deviation() -> None:
    source = random.Random(0)
    drawn = [Spread(mean=3.0, deviation=0.5).draw(source) for _ in range(4000)]
    assert sum(drawn) / 4000 == pytest.approx(3.0, abs=0.05)
    assert sum(2.5 < each < 3.5 for each in drawn) / 4000 == pytest.approx(0.683, abs=0.03)


def test_a_new_quantity_changes_no_other() -> None:
    few: dict[str, Quantity] = {"a": Spread(lowest=0, highest=1), "c": (1, 2, 3)}
    many: dict[str, Quantity] = {"b": Spread(lowest=5, highest=6), **few}
    drawn = draw_all(many, "7/3")
    assert {name: drawn[name] for name in few} == draw_all(few, "7/3")
    assert draw_all(many, "7/4") != drawn


def test_a_quantity_may_be_the_same_as_another() -> None:
    drawn = draw_all({"start": Same("x"), "x": Spread(lowest=0, highest=1)}, "1/1")
    assert drawn["start"] == drawn["x"]
    assert list(drawn) == ["start", "x"]


def test_a_quantity_may_differ_from_another_by_an_error() -> None:
    table: dict[str, Quantity] = {"x": Spread(lowest=0, highest=1), "start": Same("x", deviation=0.05)}
    errors = []
    for number in range(400):
        drawn = draw_all(table, f"1/{number}")
        errors.append(float(drawn["start"]) - float(drawn["x"]))
    assert abs(statistics.mean(errors)) < 0.01
    assert statistics.stdev(errors) == pytest.approx(0.05, rel=0.15)
    assert draw_all(table, "1/7") == draw_all(table, "1/7")


def test_names_may_be_dotted_or_nested() -> None:
    found = read(
        "[scene]\nrobot.x = { from = 1, to = 2 }\nlight = { brightness = [0.3, 1] }\nworld = 'soccer'"
    )
    assert found == {
        "robot.x": Spread(lowest=1, highest=2),
        "light.brightness": (0.3, 1),
        "world": "soccer",
    }


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("x = { from = 3, to = 1 }", "scene.x: from 3 is above to 1"),
        ("x = { from = 3 }", "scene.x: write both from and to, or mean and deviation"),
        ("x = { mean = 3 }", "scene.x: a normal distribution has both a mean and a deviation"),
        ("x = { from = -1, to = 1, log = true }", "scene.x: log is for a range whose numbers are above 0"),
        ("x = []", "scene.x: the list is empty; write the values to choose from"),
        ("x = { from = 'a', to = 2 }", "scene.x.from = 'a': write a number"),
        ("x = { from = nan, to = 2 }", "scene.x.from = nan"),
        ("x = { from = 1, until = 2 }", "scene.x.until: there is no such key; there is from, to"),
    ],
)
def test_what_cannot_be_drawn_is_refused_with_its_place(line: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"plan\.toml:2: ") as caught:
        read(f"[scene]\n{line}")
    assert message in str(caught.value)
