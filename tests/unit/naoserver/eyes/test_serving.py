"""Where `nao eyes` serves nothing."""

from __future__ import annotations

import sys

import pytest

from naoserver.fake import FakeRobot
from tests.support.nao_command import at, nao
from tests.support.processes import free_endpoint
from tests.support.robot_server import served

pytestmark = pytest.mark.slow


def test_it_refuses_where_sight_is_served():
    endpoint = free_endpoint()
    with served(FakeRobot(), realm="nao", endpoint=endpoint), at(endpoint, "nao"):
        outcome = nao("eyes")
    assert outcome.code == 1
    assert "naoserver-sim --no-sight" in outcome.text.replace("\n", " ")


def test_without_opencv_it_says_what_installs_it(monkeypatch):
    for name in [*sys.modules]:
        if name.startswith("naoserver.eyes"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cv2", None)
    outcome = nao("eyes")
    assert outcome.code == 1
    assert "pip install 'visualhfsm[vision]'" in outcome.text
