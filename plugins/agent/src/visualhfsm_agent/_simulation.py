"""The process in which an agent's behaviors run in virtual time: a question, and what happened."""

from __future__ import annotations

import base64
import io
import os
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any, Final

import msgspec

from hfsm_runtime.plugins import short_repr
from visualhfsm.plugins import TaskProcesses, answer_tasks
from visualhfsm.simulation import RobotKind, simulate
from visualhfsm.trials import quiet
from zenoh_ice.application.tether import die_with
from zenoh_ice.data.text import encodable, text_of

_MOST: Final = 200
"""Calls, and lines of the timeline, that are listed: the last."""
_LONGEST: Final = 200
"""Characters of a call."""
PATIENCE: Final = 120.0
"""Wall seconds of a run."""


@dataclass(frozen=True)
class Question:
    """A document to run, for some s, on a robot, perhaps with a picture of its camera at the end."""

    document: str
    seconds: float
    robot: RobotKind
    picture: bool


class Simulated(msgspec.Struct, frozen=True):
    """What happened."""

    time: float
    states: list[str]
    error: str
    timeline: list[str]
    calls: list[str]
    reads: dict[str, int]
    """How often operations were called that begin with `get`; these are no calls of the list."""
    variables: dict[str, str]
    joints: dict[str, float]
    picture: str = ""
    """PNG, in base 64."""


def processes() -> TaskProcesses[Simulated]:
    """Return the processes that run behaviors."""
    return TaskProcesses(__name__, Simulated, "visualhfsm-agent-")


def _run(question: Question) -> Simulated:
    with quiet(), ExitStack() as ends:
        try:
            run = ends.enter_context(simulate(question.document, robot=question.robot, stand_ins=True))
        except (Exception, SystemExit) as failure:  # noqa: BLE001 - whatever its variables and modules raise
            why = encodable(text_of(failure)) or type(failure).__name__
            return Simulated(0.0, [], why, [], [], {}, {}, {})
        error = ""
        try:
            run.advance(question.seconds)
        except Exception as failure:  # noqa: BLE001 - whatever the behavior raises
            error = encodable(text_of(failure).partition("\ntimeline of ")[0])
        calls: list[str] = []
        reads: Counter[str] = Counter()
        for each in run.calls():
            if each.target.rpartition(".")[2].startswith("get"):
                reads[each.target] += 1
            else:
                calls.append(f"{each.time:.3f} s {each.target} {each.arguments}"[:_LONGEST])
        found: dict[str, Any] = {}
        for actor in run.tree.actors:
            found |= run.variables(actor.automaton.id)
        return Simulated(
            time=run.time,
            states=[*run.active_paths],
            error=error,
            timeline=run.timeline.splitlines()[-_MOST:],
            calls=calls[-_MOST:],
            reads=dict(reads),
            variables={name: short_repr(value) for name, value in found.items()},
            joints=run.robot.joints,
            picture=_look(run.robot) if question.picture else "",
        )


def _look(robot: Any) -> str:  # noqa: ANN401 - a RobotUnderTest
    frame = robot.look()
    return png_of(frame.pixels.tobytes(), (frame.width, frame.height))


def png_of(pixels: bytes, size: tuple[int, int]) -> str:
    """Return a picture, in RGB, as PNG in base 64."""
    from PIL import Image  # not for those who look at nothing

    file = io.BytesIO()
    Image.frombytes("RGB", size, pixels).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()


if __name__ == "__main__":
    die_with(os.getppid())
    answer_tasks(_run)
