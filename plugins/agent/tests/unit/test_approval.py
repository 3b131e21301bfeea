"""A person's leave for one run, which several agents of a folder ask for."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from tests.support.soak import repeated
from visualhfsm_agent._approval import Approvals
from visualhfsm_agent._limits import AgentError


def test_of_racing_agents_one_runs_for_one_leave(tmp_path: Path) -> None:
    page, ran = Approvals(tmp_path), list[int]()
    for number in range(repeated(test=50, soak=3000)):
        with pytest.raises(AgentError, match="a person must allow"):
            page.require("digest", "look.xml", 5.0)
        asked = page.asked()
        assert asked is not None
        page.answer(asked, "allowed")
        begin = threading.Barrier(4)

        def run(number: int = number, begin: threading.Barrier = begin) -> None:
            agent = Approvals(tmp_path)
            begin.wait()
            try:
                agent.require("digest", "look.xml", 5.0)
            except AgentError:
                return
            ran.append(number)

        threads = [threading.Thread(target=run) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert ran == [*range(number + 1)]
        (tmp_path / ".visualhfsm-agent" / "asked.json").unlink(missing_ok=True)  # by those that came too late
