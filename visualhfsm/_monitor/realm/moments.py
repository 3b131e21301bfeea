"""The moments of a component as a page gets them: what is said in them are messages."""

from __future__ import annotations

from typing import Annotated, Any

import msgspec
from msgspec.structs import replace

from codegen.messages import Message, joined
from visualhfsm._base.recognition import recognized
from visualhfsm._document.views import of_page
from visualhfsm._monitor.realm.run_log import LiveSnapshot
from zenoh_ice.data import typed

__all__ = ["Moment", "translate_moment", "translate_snapshot"]


def translate_snapshot(snapshot: LiveSnapshot) -> LiveSnapshot:
    """Return a snapshot in which errors, a refusal and the events of the robot are messages."""
    component, robot = snapshot.component, snapshot.robot
    if component.errors or component.refusal:
        component = replace(
            component,
            errors=[replace(each, message=recognized(each.message)) for each in component.errors],
            refusal=_refusal(component.refusal),
        )
    if robot.health is not None and robot.health.events:
        events = [replace(each, message=recognized(each.message)) for each in robot.health.events]
        robot = replace(robot, health=replace(robot.health, events=events))
    return replace(snapshot, component=component, robot=robot)


Moment = Annotated[Any, of_page("LiveSnapshot")]
"""A `LiveSnapshot`, or what a log has of one."""


def translate_moment(moment: msgspec.Raw | None) -> dict[str, Any] | None:
    """Return a snapshot of a log in the same way; None for none."""
    if moment is None:
        return None
    found: dict[str, Any] = typed.from_json(moment)  # of no type: in JSON, what is not known is null
    component, health = found["component"], found["robot"]["health"] or {}
    component["refusal"] = _refusal(component["refusal"])
    for each in (*component["errors"], *health.get("events", ())):
        each["message"] = recognized(each["message"])
    return found


def _refusal(text: str) -> Message:
    """Return what a component says of a refused command, behind the place in its automata."""
    place, separator, why = text.partition(": ")
    return joined(": ", [place, recognized(why)]) if separator else Message.verbatim(text)
