"""The pages about NAOqi list the options of the command, and every operation."""

import re

import pytest
import typer

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")

from naoserver.fake import __main__ as fake
from naoserver.hardware.connection import HardwareLimits
from tests.support.places import ROOT
from visualhfsm_naoqi.programs._service import REFUSED
from visualhfsm_naoqi.robot import _command as naoqi
from visualhfsm_naoqi.robot._robot import Life, NaoEnd, NaoStart

hooks = pytest.importorskip("docs.hooks", reason="needs the packages of visualhfsm[docs]")

PAGE = (ROOT / "plugins/naoqi/docs/real-nao.md").read_text(encoding="utf-8")


def options(app):
    return {name for parameter in typer.main.get_command(app).params for name in parameter.opts}


def test_every_option_of_its_own_is_explained():
    own = options(naoqi.app) - options(fake.app)  # the fake robot's are those of every command
    assert own >= {"--robot", "--life"}
    assert [option for option in own if f"`{option}" not in PAGE] == []


@pytest.mark.parametrize(("option", "choices"), [("start", NaoStart), ("end", NaoEnd), ("life", Life)])
def test_every_choice_is_named_in_its_order(option, choices):
    assert rf"`--{option} " + r"\|".join(choices) + "`" in PAGE


def test_the_silence_after_which_a_robot_is_lost_is_that_of_the_page():
    assert f"a silent robot after {HardwareLimits().silence:g} s" in PAGE


def test_every_operation_of_naoqi_says_how_well_it_works() -> None:
    rows = dict(re.findall(r"^\| `([\w.]+)` \| (\w+) \| .{10}", hooks.naoqi(), re.MULTILINE))
    assert set(rows.values()) == {"works", "approximated", "refused"}
    assert rows["ALMotion.setAngles"] == "works"
    assert rows["ALMotion.setFallManagerEnabled"] == "approximated"
    assert rows["ALFrameManager.playBehavior"] == "works"
    assert rows["ALFrameManager.createTimeline"] == "refused"
    for name, service in REFUSED.items():
        assert {rows[f"{name}.{each}"] for each in service.operations} <= {"refused"}
        assert {rows[f"{name}.{each}"] for each in service.off} <= {"approximated"}
    assert not [name for name in rows if "._" in name]
