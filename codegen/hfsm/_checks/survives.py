"""Check the failures of the robot that a document must survive.

Which parts a robot has, and how they fail, is known where it is tried: by `visualhfsm verdict`.
"""

from __future__ import annotations

import math
from typing import Final

from ...messages import Message
from ..codes import Code
from ..document import SUCCEED, Document, Survives
from ..report import Report

_LATEST: Final = 3600.0  # s


def check_survives(document: Document, report: Report) -> None:
    """Report failures without a part or a kind, and numbers that are none."""
    for each in document.survives:
        if (message := _wrong(each)) is not None:
            report.error(Code.BAD_SURVIVAL, message, each)


def _wrong(survives: Survives) -> Message | None:
    if not survives.part.strip() or not survives.kind.strip():
        return Message("`survives` needs the part of the robot that fails, and how: Camera, black")
    if survives.must not in ("", SUCCEED):
        return Message("`must` is `{value}`: write `succeed`, or nothing", value=survives.must[:40])
    if survives.amount and not math.isfinite(_number(survives.amount)):
        return Message("`amount` is `{value}`: write a number, such as 0.5", value=survives.amount[:40])
    if survives.after and not 0.0 <= _number(survives.after) <= _LATEST:
        return Message(
            "`after` is `{value}`: write seconds from 0 to {latest:g}",
            value=survives.after[:40],
            latest=_LATEST,
        )
    return None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
