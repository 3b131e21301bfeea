"""Other ways into a robot: what plug-ins add to `naoserver-sim`."""

import logging
from contextlib import nullcontext
from typing import Annotated

import pytest
import typer

from naoserver.serving.entrances import Entrance, find_entrances, flag, later_port, options_of
from tests.support.plugins import installed

SEAM = "naoserver.entrances"
MADE = """
from contextlib import nullcontext
from naoserver.serving.entrances import Entrance

made = Entrance(
    programs="Morse",
    options={"morse_key": (int, 0)},
    serve=lambda robot, assembly, options: nullcontext("by wire"),
    example=("naoserver-sim --morse-key 7", "who taps drives it"),
)
"""


def an_entrance(**options):
    return Entrance(
        programs="Morse",
        options=options,
        serve=lambda robot, assembly, options: nullcontext(""),
        example=("", ""),
    )


def test_the_entrance_of_a_stranger_is_found(tmp_path):
    with installed(tmp_path, {SEAM: {"morse": "stranger:made"}}, stranger=MADE):
        assert "Morse" in [each.programs for each in find_entrances()]
    assert "Morse" not in [each.programs for each in find_entrances()]


def test_one_that_cannot_be_loaded_is_named_and_leaves_the_others(tmp_path, caplog):
    points = {SEAM: {"morse": "stranger:made", "broken": "breaks:made"}}
    with (
        installed(tmp_path, points, stranger=MADE, breaks="raise ValueError('no key')"),
        caplog.at_level(logging.WARNING),
    ):
        assert "Morse" in [each.programs for each in find_entrances()]
    assert "the plug-in broken of a-stranger (breaks:made) cannot be loaded: no key" in caplog.text


@pytest.mark.parametrize(
    ("value", "wanted"), [(None, False), (False, False), (True, True), (0, True), ("", True)]
)
def test_its_first_option_asks_for_it(value, wanted):
    entrance = an_entrance(first_one=(str, None), other=(int, 1))
    assert entrance.is_wanted({"first_one": value, "other": 3}) is wanted
    assert flag(entrance.asked_by) == "--first-one"


def test_what_several_have_in_common_is_one_option():
    kind = Annotated[int, typer.Option(min=0)]
    options = options_of(
        [an_entrance(a=(bool, False), wire=(kind, 1)), an_entrance(b=(bool, False), wire=(kind, 1))]
    )
    assert [(each.name, each.default) for each in options] == [("a", False), ("wire", 1), ("b", False)]


@pytest.mark.parametrize(
    ("address", "later"),
    [("tcp://127.0.0.1:9559", "tcp://127.0.0.1:9561"), ("tcp://127.0.0.1:0", "tcp://127.0.0.1:0")],
)
def test_each_robot_has_a_port_of_its_own_unless_the_system_picks_it(address, later):
    assert later_port(address, 2) == later
