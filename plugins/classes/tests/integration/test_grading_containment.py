"""A document means the same in and out of its containment: states, times, calls and what is logged."""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from hfsm_runtime._variables import variables_of
from hfsm_runtime.virtual import BehaviorFailed
from tests.support.documents import document, state, sub, transition
from tests.support.places import ROOT
from tests.support.soak import cases
from visualhfsm.simulation import Behavior, simulate
from visualhfsm_classes import Containment

BEHAVIORS: Final = sorted((ROOT / "behaviors").glob("*.xml"))
COMPONENTS: Final = sorted((ROOT / "tests" / "data" / "components").glob("*.xml"))
OTHERS: Final = ("imports.xml", "extension.xml")
"""They need files in folders, and a module, which submissions do not have."""
DOCUMENTS: Final = [path for path in (*BEHAVIORS, *COMPONENTS) if path.name not in OTHERS]
SECONDS: Final = 6.0
IN_TEST: Final = ("follow_ball", "entry_exit", "events", "history", "inputs_and_arguments", "own_names")
"""Documents that `make test` runs, too: one of ours, and each way in which code is run, or reads what is not its own."""

USES_ALL_OF_SELF: Final = document(
    sub(
        1,
        0,
        state(1, "asks", "seen.append((random.random(), round(np.random.random(), 9), time.monotonic()))\n"
              "self.sleep(0.03)\ntime.sleep(0.02)\nseen.append(self.clock.now())\n"
              "self.send('asked', {'number': [1, 2.5, None]})\nself.mark('Camera', 3.0, 4.0, 'ball')\n"
              "self.Head.setPose(0.1 * len(seen), 0.0, 0.5)\nself.log.warning('seen %s', len(seen))",
              initial=True),
        state(2, "listens", "sample = self.Head.getPose.latest()\n"
              "seen.append(None if sample is None else (sample.value.pan, round(sample.age, 6)))\n"
              "if not heard and subscription is None:\n"
              "    subscription = self.Head.getPose.subscribe(lambda pose: heard.append(self.clock.now()))"),
        state(3, "waits", "seen.append(self.Head.getPose.wait().value.pan)\nseen.append(len(heard))"),
        state(4, "fails", "seen.append(self.Head.getPose.begin().result().tilt)\n"
              "try:\n    self.Head.setPose(float('inf'), 0.0, 0.5)\nexcept Exception as error:\n"
              "    seen.append(repr(error))\nraise KeyError('at the end')"),
        transition(1, 1, 2, "asked", type="event", code="seen.append(event.data)"),
        transition(2, 2, 3, "1000", type="time"),
        transition(3, 3, 4, "len(heard) > 3"),
        variables="seen = []\nheard = []\nsubscription = None",
    ),
    libraries=("random", "time", "numpy as np"),
    config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>",
)  # fmt: skip


SLEEPS_SIDE_BY_SIDE: Final = document(
    sub(1, 0, state(1, "a", initial=True, child=2), state(2, "b"), transition(1, 1, 2, "1450", type="time"),
        transition(2, 2, 1, "300", type="time")),
    sub(2, 1, state(1, "c", "self.log.warning('sleeps')\nself.sleep(5.0)", initial=True, child=3)),
    sub(3, 2, state(1, "d", "time.sleep(0.13)\nself.log.warning('slept')", initial=True),
        state(2, "f", "self.log.warning('heard %s', self.Head.getPose.wait().value.pan)"),
        transition(1, 1, 2, "400", type="time"), transition(2, 2, 1, "200", type="time"), period="70"),
    libraries=("time",),
    config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>",
)  # fmt: skip
"""Two automata sleep at a time, one below the other, and the upper one is left meanwhile."""


def seen_of(make: Callable[..., Behavior], path: Path, variable: str = "") -> dict[str, Any]:
    """Return all that a behavior does in some seconds, and the values of a variable of its root."""
    random.seed(5)
    np.random.seed(5)
    behavior = make(path, robot="fake", stand_ins=True)
    try:
        failed = False
        try:
            for _ in range(round(SECONDS * 10)):
                behavior.advance(0.1)
        except BehaviorFailed:
            failed = True
        calls = [
            (
                each.time,
                each.target,
                each.arguments,
                each.result,
                type(each.error),
                each.automaton,
                each.state,
            )
            for each in behavior.calls()
        ]
        return {
            "failed": failed,
            "fired": behavior.fired,
            "changes": [(each.time, each.automaton, each.state, each.kind) for each in behavior.trace],
            "calls": calls,
            "time": behavior.time,
            "timeline": behavior.timeline,
            "errors": [(each.time, each.location, each.message) for each in behavior.errors],
            "marks": behavior.marks.shown(behavior.component_time.now()),
            "variable": listed(behavior.variables(1)[variable]) if variable else None,
        }
    finally:
        behavior.close()


def listed(value: object) -> object:
    return [listed(each) for each in value] if isinstance(value, list | tuple) else value


@pytest.fixture(scope="module")
def containment() -> Iterator[Containment]:
    with Containment(files=BEHAVIORS) as containment:
        yield containment


@pytest.mark.parametrize(
    "path",
    cases(
        [path for path in DOCUMENTS if path.stem in IN_TEST],
        soak=[path for path in DOCUMENTS if path.stem not in IN_TEST],
    ),
    ids=lambda path: path.stem,
)
def test_a_document_means_the_same_inside(containment: Containment, path: Path) -> None:
    assert seen_of(containment.simulate, path) == seen_of(simulate, path)


def test_all_that_code_may_use_is_the_same_inside(containment: Containment, tmp_path: Path) -> None:
    path = tmp_path / "all.xml"
    path.write_text(USES_ALL_OF_SELF, encoding="utf-8")
    inside = seen_of(containment.simulate, path, "seen")
    assert inside == seen_of(simulate, path, "seen")
    assert [each[2] for each in inside["changes"]] == ["asks", "listens", "waits", "fails"]


def test_what_is_refused_is_heard_the_same_inside(containment: Containment, tmp_path: Path) -> None:
    asks = state(1, "asks", "self.Head.setPose(float('inf'), 0.0, 0.5)", initial=True)
    looks = state(2, "looks", "raise ObjectNotExistException('there is no eye')")
    hears = [
        transition(number, number, number + 1, "refused", type="event", code="seen.append(event.data)")
        for number in (1, 2)
    ]
    text = document(
        sub(1, 0, asks, looks, state(3, "ends"), *hears, variables="seen = []"),
        libraries=("from zenoh_ice import ObjectNotExistException",),
        config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>",
    )
    path = tmp_path / "refused.xml"
    path.write_text(text, encoding="utf-8")
    inside = seen_of(containment.simulate, path, "seen")
    assert inside == seen_of(simulate, path, "seen")
    assert (inside["failed"], inside["errors"]) == (False, [])
    assert inside["variable"][1] == "there is no eye"
    assert len(inside["variable"]) == 2


def test_everything_is_stopped_where_exit_code_is_cut_inside_as_outside(
    containment: Containment, tmp_path: Path
) -> None:
    leave = "<exit>self.sleep(5.0)\nself.hold()</exit></state>"
    text = document(
        sub(1, 0, state(1, "a", initial=True, child=2), state(2, "b"), transition(1, 1, 2, "500", type="time"),
            functions="def hold(self):\n    self.Head.stop()"),
        sub(2, 1, state(1, "c", initial=True).replace("</state>", leave), state(2, "d"),
            transition(1, 1, 2, "200", type="time")),
        config="<iceinterface><nameinterface>Head</nameinterface><nameproxy>Head</nameproxy><interface>PoseHead</interface></iceinterface>",
    )  # fmt: skip
    path = tmp_path / "cut.xml"
    path.write_text(text, encoding="utf-8")
    inside = seen_of(containment.simulate, path)
    assert inside == seen_of(simulate, path)
    assert [each[:2] for each in inside["calls"]] == [(0.5, "Head.stop")]


def test_code_of_several_automata_sleeps_side_by_side_inside_as_outside(
    containment: Containment, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "sleeps.xml"
    path.write_text(SLEEPS_SIDE_BY_SIDE, encoding="utf-8")
    outside, logged = seen_of(simulate, path), list(caplog.messages)
    caplog.clear()
    assert seen_of(containment.simulate, path) == outside
    assert caplog.messages == logged
    assert [each[:3] for each in outside["changes"] if each[1] == "sleeps" and each[0] < 3.5] == [
        (0.0, "sleeps", "a"), (1.5, "sleeps", "b"), (1.8, "sleeps", "a"), (3.3, "sleeps", "b"),
    ]  # fmt: skip
    assert logged.count("sleeps") < logged.count("slept") > 10


def test_a_recording_can_have_the_variables(tmp_path: Path) -> None:
    path = tmp_path / "counts.xml"
    counts = state(1, "counts", "count += 1\nlist.append(count)", initial=True)
    path.write_text(document(sub(1, 0, counts, variables="count = 0\nlist = []")), encoding="utf-8")
    with Containment(shows_variables=True) as containment, containment.simulate(path) as behavior:
        behavior.advance(0.2)
        assert variables_of(behavior.tree.root.automaton) == {"count": "3", "list": "[1, 2, 3]"}
        behavior.advance(0.1)
        assert variables_of(behavior.tree.root.automaton) == {"count": "4", "list": "[1, 2, 3, 4]"}


def test_numpy_computes_inside_as_it_does_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Results of other kernels differ in their last bits, and trials with them.
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Nehalem")
    monkeypatch.setenv("SECRET", "of the teacher")
    path = tmp_path / "asks.xml"
    code = "seen = [os.environ.get(name) for name in ('OPENBLAS_CORETYPE', 'SECRET')]"
    path.write_text(
        document(sub(1, 0, state(1, "asks", code, initial=True), variables="seen = []"), libraries=("os",))
    )
    with Containment() as containment:
        assert seen_of(containment.simulate, path, "seen")["variable"] == ["Nehalem", None]


def test_our_packages_are_seen_in_no_place_but_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site-packages"
    installed = ("naoserver", "visualhfsm", "visualhfsm_classes", "visualhfsm_match")
    for name in (*installed, "visualhfsm-0.dist-info"):
        (site / name).mkdir(parents=True)
        (site / name / "__init__.py").touch()
    (site / "visualhfsm-0.dist-info" / "METADATA").write_text("Name: visualhfsm\nVersion: 0\n")
    (site / "visualhfsm-0.dist-info" / "RECORD").write_text(
        "".join(f"{name}/__init__.py,,\n" for name in installed)
    )
    monkeypatch.setattr(sys, "path", [*sys.path, str(site)])
    path = tmp_path / "looks.xml"
    code = "\n".join(
        f"seen[{name!r}] = glob.glob('/packages/site*/{name}/*')"
        for name in (*installed, "visualhfsm-0.dist-info")
    )
    path.write_text(
        document(sub(1, 0, state(1, "looks", code, initial=True), variables="seen = {}"), libraries=("glob",))
    )
    with Containment() as containment:
        seen = seen_of(containment.simulate, path, "seen")["variable"]
    assert seen.pop("visualhfsm-0.dist-info")
    assert not any(seen.values())
