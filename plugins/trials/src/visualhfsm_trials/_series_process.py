"""The process that runs trials for the editor, and reports each few moments what they say so far.

Its only argument is an `Order`, and it writes lines of JSON: one `Report` each. Outcomes are kept beside the
document, as by the command, which goes on with them. Code of users runs in processes below this one.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Final

import msgspec
from msgspec import UNSET, UnsetType

from codegen.reasons import reason
from naoserver.bodies import DEFAULT_BODY
from visualhfsm import VisualHfsmError
from visualhfsm.plugins import encode_message
from visualhfsm.trials import SUFFIX, LocalPool, Outcome, Plan, TrialsError, plan_of
from zenoh_ice.application.cli import stop_on_signals
from zenoh_ice.data import typed

from ._drawn import view_of
from ._facts import facts_of
from ._messages import Order, PlanFacts, Report
from ._record import SUFFIX as OUTCOMES
from ._record import Record, read_header
from ._series import KeptSeries
from ._summary import summarize, write_table

_PERIOD: Final = 0.4
"""Shortest time in s between two reports."""
_SHARE: Final = 10
"""A report that takes long is made so much rarer, so that it takes a tenth of the time at most."""
_NICE: Final = 5
_LONGEST_ERROR: Final = 4000


class _Work:
    """One order, and what is reported of it."""

    def __init__(self, order: Order, send: Callable[[Report], object], stop: threading.Event) -> None:
        self._order = order
        self._send = send
        self._stop = stop
        self._document = Path(order.document)
        self._facts: PlanFacts | UnsetType = UNSET
        self._began = 0.0
        self._ended = 0
        self._next = 0.0

    def do(self) -> None:
        """Carry the order out. Raises VisualHfsmError."""
        plan = self._plan()
        series = KeptSeries(plan, Path(self._order.content).read_bytes())
        file = self._document.with_name(self._document.stem + OUTCOMES)
        found = read_header(file) if file.is_file() else None
        outdated = found is not None and found != series.header
        if self._order.action == "record":
            if found is None or outdated:
                raise TrialsError.because(
                    "the document, its plan or a file beside it has changed: run the trials again"
                )
            self._record(series)
        elif self._order.action == "look" or (outdated and not self._order.again):
            self._report(plan, None if found is None else file, outdated=outdated)
        else:
            self._run(series, file, again=outdated)

    def _plan(self) -> Plan:
        order, choices = self._order, self._order.choices
        given = {name: value for name in ("runs", "limit", "robot") if (value := getattr(choices, name))}
        beside = self._document.with_name(self._document.stem + SUFFIX)
        plan = plan_of(self._document, choices.state or None, **given)
        if choices.body not in ("", DEFAULT_BODY) and "body" not in plan.scene and plan.robot != "none":
            plan = msgspec.structs.replace(plan, scene={**plan.scene, "body": choices.body})
        self._facts = facts_of(plan, beside.name if beside.is_file() else "")
        self._send(Report(plan=self._facts))
        return msgspec.structs.replace(plan, document=order.document)

    def _run(self, series: KeptSeries, file: Path, *, again: bool) -> None:
        plan = series.plan
        with Record(file, series.header, again=again) as record:
            self._report(plan, file)
            missing = sum(number not in record.done for number in plan.trials)
            if missing:

                def ended(_: Outcome) -> None:
                    self._began = self._began or time.monotonic()
                    self._ended += 1
                    if time.monotonic() > self._next and self._ended < missing:
                        self._report(plan, file, missing - self._ended)

                with LocalPool(self._order.workers) as pool:
                    series.run(record, pool, ended, self._stop)
        self._report(plan, file)
        known = None if again else summarize(file, plan.varying)
        write_table(file.with_suffix(".csv"), summarize(file, plan.varying, plan.runs), known)

    def _record(self, series: KeptSeries) -> None:
        target = Path(self._order.recording)
        series.record({self._order.number: target}, 1, self._stop)

    def _report(self, plan: Plan, file: Path | None, missing: int = 0, *, outdated: bool = False) -> None:
        """Report what the outcomes of a file say; `missing` ones are still to come."""
        begun = time.monotonic()
        measured = self._ended - 1  # the first one started its process, too
        left = (begun - self._began) / measured * missing if measured > 0 and missing else None
        view = None if file is None else view_of(plan, summarize(file, plan.varying, plan.runs), file)
        self._send(Report(plan=self._facts, view=view, left=left, outdated=outdated))
        now = time.monotonic()
        self._next = now + max(_PERIOD, _SHARE * (now - begun))


def _sender(output: BinaryIO) -> Callable[[Report], object]:
    def send(report: Report) -> None:
        output.write(msgspec.json.encode(report, enc_hook=encode_message) + b"\n")
        output.flush()

    return send


def main() -> None:
    """Carry out the order of the command line."""
    order = typed.from_json(sys.argv[1], Order)
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    os.nice(_NICE)
    send = _sender(output)
    with stop_on_signals() as stop:
        try:
            _Work(order, send, stop).do()
        except (VisualHfsmError, OSError) as error:
            send(Report(error=reason(error)))


if __name__ == "__main__":
    main()
