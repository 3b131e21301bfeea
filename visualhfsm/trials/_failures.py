"""What can fail in the trials of a plan: the parts of the body that it names."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import msgspec

from naoserver.bodies import DEFAULT_BODY
from naoserver.bodies.faults import failures_of, kinds_of, left_of
from naoserver.errors import InvalidCommand, RobotError
from naoserver.protocol.faults import Faults
from naoserver_sim.named_body import named_body
from zenoh_ice import WallClock

from ._errors import TrialsError
from ._plan import Plan

if TYPE_CHECKING:
    from naoserver.body import Body


def with_failure(plan: Plan, part: str, kind: str, amount: float | None, at: float) -> Plan:
    """Return a plan in whose trials a part fails, and which go on from there for as long as those of `plan`.

    One for a robot without physics gets one with it for what takes forces. Raises TrialsError for a failure
    that its body cannot have.
    """
    body = _body_of(plan)
    with TrialsError.in_place_of(InvalidCommand, "{part} cannot fail: {reason}", part=part):
        Faults(body, WallClock(), physics=True).check(part, kind, amount)
    if plan.robot == "fake" and kind not in _names(body, physics=False).get(part, ()):
        plan = msgspec.structs.replace(plan, robot="sim", camera="drawn", memory=Plan().memory)
    return msgspec.structs.replace(
        plan, limit=at + plan.limit, failures=(f"{part} {kind}",), fails_at=at, fails_by=amount
    )


def untried_failures(plan: Plan, tried: Collection[str]) -> tuple[int, int]:
    """Return how many failures of a plan's robot were never tried, and of how many: those of a sweep.

    Raises TrialsError.
    """
    alike = {*tried, *map(left_of, tried)}
    failures = [*failures_of(kinds_of(_body_of(plan), physics=plan.robot == "sim"))]
    return sum(each not in alike for each in failures), len(failures)


def ways_to_fail(body: str) -> dict[str, list[str]]:
    """Return how each part of a body can fail, by names. Raises TrialsError for a body that there is not."""
    return _names(_body_of(Plan(scene={"body": body})), physics=True)


def _names(body: Body, *, physics: bool) -> dict[str, list[str]]:
    kinds = kinds_of(body, physics=physics)
    return {part: [kind.name for kind in each] for part, each in kinds.items() if each}


def _body_of(plan: Plan) -> Body:
    name = plan.scene.get("body", DEFAULT_BODY)
    if not isinstance(name, str):
        raise TrialsError.because("what fails is of one robot: write its body in the plan, or none")
    with TrialsError.in_place_of(RobotError):
        return named_body(name)
