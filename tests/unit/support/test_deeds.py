"""A quick test that does what takes long is told the mark for it."""

from __future__ import annotations

import socket
import subprocess
from types import SimpleNamespace
from typing import Any

import pytest

from tests.support.deeds import begin_test, undue_deeds
from tests.support.places import ROOT
from zenoh_ice import initialize


def stand_in(folder: str, *marks: str) -> Any:
    """Return a stand-in for a test in a folder, which begins now."""
    test: Any = SimpleNamespace(path=ROOT / folder / "test_it.py", keywords=set(marks), stash=pytest.Stash())
    begin_test(test)
    return test


@pytest.mark.slow
def test_what_a_unit_test_does_without_the_mark_for_it_is_named() -> None:
    quick = stand_in("tests/unit/room")
    others = [
        stand_in(folder, *marks)
        for folder, *marks in (
            ("tests/unit/room", "slow"),
            ("tests/integration",),
            ("tests/doors",),
            ("plugins/one/tests/unit",),
        )
    ]
    assert undue_deeds(quick) == ""
    subprocess.run(["true"], check=True)
    assert undue_deeds(quick) == "1 processes without `slow`"
    with socket.create_server(("127.0.0.1", 0)):
        assert undue_deeds(quick) == "1 processes without `slow`, 1 sockets without `slow`"
    after = stand_in("tests/unit/room")
    with initialize(clock="wall", connect=[], listen=[]):
        assert "1 sessions without `slow`" in undue_deeds(after)
    assert [undue_deeds(each) for each in others] == [""] * 4


@pytest.mark.sim
def test_a_model_of_mujoco_needs_another_mark() -> None:
    pytest.importorskip("mujoco")
    from naoserver_sim.model import build_model

    quick = stand_in("tests/unit/room")
    build_model(skin=False)
    assert undue_deeds(quick) == "1 models without `sim`"
