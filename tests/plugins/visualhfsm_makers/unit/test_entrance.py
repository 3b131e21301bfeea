import tomllib
from importlib.metadata import EntryPoint

import pytest

from tests.support.places import ROOT
from visualhfsm_makers import BOOSTER, UNITREE


@pytest.mark.parametrize(("maker", "serve"), [("unitree", UNITREE), ("booster", BOOSTER)])
def test_the_project_declares_the_entrances_of_makers(maker, serve):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = project["entry-points"]["naoserver.entrances"][maker]
    assert EntryPoint(maker, declared, "naoserver.entrances").load() is serve
    assert project["optional-dependencies"][maker] == ["cyclonedds==11.0.1"]
