"""Reload a running component through its monitor: generated files, real threads, Zenoh on loopback."""

from __future__ import annotations

import contextlib
import os
import random
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from hfsm_runtime._limits import LIMITS, RuntimeLimits
from hfsm_runtime._robot import connect
from hfsm_runtime._runtime import Runtime
from hfsm_runtime.debugger.monitor import Monitor
from interfaces.hfsm import (
    Breakpoint,
    ComponentSnapshot,
    ComponentStatus,
    HfsmMonitorPrx,
    InvalidValue,
    NoSuchElement,
    ReloadRefused,
)
from interfaces.nao import HeadLimits, HeadPose, PoseHead
from tests.integration.test_hfsm_monitor import first_snapshot
from tests.support.documents import compile_to, document, load, state, sub, transition
from tests.support.limited import HASTY
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT, FOREVER, RUN_LIMIT
from tests.support.suite import Pair
from tests.support.waiting import until
from zenoh_ice import Communicator, Current, WallClock
from zenoh_ice.application.patience import Patience

HEAD = (
    "<iceinterface><nameinterface>head</nameinterface><nameproxy>Head</nameproxy>"
    "<interface>PoseHead</interface></iceinterface>"
)


def walker(
    *,
    seconds: float = 3600.0,
    step: int = 1,
    state_name: str = "b",
    more: str = "",
    config: str = "",
    functions: str = "",
) -> str:
    """Return a document that goes from a to b at the event `go`; both count."""
    return document(
        sub(
            1, 0,
            state(1, "a", f"count += {step}", initial=True),
            state(2, state_name, "count += self.stride()", child=2),
            transition(1, 1, 2, "go", type="event", name="go"),
            transition(2, 2, 1, str(round(seconds * 1000)), type="time", name="enough"),
            variables="count = 0", functions=f"def stride(self):\n    return {step}\n{functions}", period="20",
        ),
        sub(2, 1, state(1, "red", "seen = seen + [1]", initial=True), variables="seen = []", period="20"),
        more,
        config=config, events=("go",),
    )  # fmt: skip


class Version:
    """A component in a file that can be rewritten."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.file = Path()

    def write(self, text: str) -> None:
        self.file = compile_to(self.directory, text, "walker")


@contextmanager
def running(
    pair: Pair, version: Version, limits: RuntimeLimits = LIMITS, **attributes: object
) -> Iterator[tuple[Runtime, HfsmMonitorPrx]]:
    component = load(version.file)
    connect(component, pair.server)
    vars(component).update(attributes)
    runtime = Runtime(component, WallClock(), limits=limits)
    again = partial(connect, communicator=pair.server, patience=Patience(0.0))
    with Monitor(runtime, pair.server, connect_proxies=again):
        runtime.start()
        try:
            yield runtime, HfsmMonitorPrx.checkedCast(pair.client.stringToProxy("Hfsm.walker"))
        finally:
            runtime.stop()


@pytest.fixture
def version(tmp_path: Path) -> Version:
    made = Version(tmp_path)
    made.write(walker())
    return made


def count(snapshot: ComponentSnapshot) -> int:
    return int(snapshot.automata[0].variables["count"])


def in_b(proxy: HfsmMonitorPrx) -> ComponentSnapshot:
    proxy.sendEvent("go", "")
    return first_snapshot(
        proxy,
        lambda snapshot: snapshot.automata[0].state == 2 and "[1" in snapshot.automata[1].variables["seen"],
    )


def test_the_new_document_goes_on_in_the_state_with_the_variables(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        before = in_b(proxy)
        version.write(walker(seconds=7200.0, step=1_000_000))
        report = proxy.reload()
        assert (report.generation, report.notKept) == (1, [])
        assert report.held > 0.0
        after = first_snapshot(
            proxy, lambda snapshot: snapshot.generation == 1 and count(snapshot) > 1_000_000
        )
        root, child = after.automata
        assert (root.state, child.state, child.ghost) == (2, 1, False)
        assert (root.enteredAt, root.lastTransition) == (before.automata[0].enteredAt, 1)
        assert 7000 < root.timers[0].remaining < 7200
        assert (count(after) - count(before)) % 1_000_000 < 100_000  # it went on from there, in new steps
        assert root.cycles > before.automata[0].cycles
        assert child.variables["seen"].startswith(before.automata[1].variables["seen"][:-1])
        structure = proxy.getStructure()
        assert structure.generation == 1
        assert structure.automata[0].transitions[1].seconds == 7200.0


def test_a_timer_that_is_shorter_now_fires(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        in_b(proxy)
        version.write(walker(seconds=0.05))
        proxy.reload()
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].state == 1)


def test_it_can_be_reloaded_again_and_again(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        in_b(proxy)
        for generation in range(1, 6):
            version.write(walker(step=10**generation))
            assert proxy.reload().generation == generation
            first_snapshot(proxy, lambda snapshot, least=10**generation: count(snapshot) > least)  # type: ignore[misc]


def test_automata_come_and_go_with_their_threads(pair: Pair, version: Version) -> None:
    def names() -> set[str]:
        return {t.name for t in threading.enumerate() if t.name.startswith("automaton ")}

    more = sub(3, 2, state(1, "x", "hits += 1", initial=True), variables="hits = 0", period="20")
    with running(pair, version) as (_, proxy):
        in_b(proxy)
        before = names()
        version.write(
            walker(more=more).replace(
                '"1"><name>red</name><idSubautomataSon>0', '"1"><name>red</name><idSubautomataSon>3'
            )
        )
        assert proxy.reload().notKept == []
        first_snapshot(
            proxy, lambda snapshot: len(snapshot.automata) == 3 and snapshot.automata[2].cycles > 3
        )
        assert names() == before | {"automaton red"}
        version.write(walker())
        assert proxy.reload().notKept == ["automaton 3 (red) is gone, which was in x"]
        until(lambda: names() == before)
        assert len(proxy.getSnapshot().automata) == 2


def test_breakpoints_stay_where_their_elements_do(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        kept, dropped = Breakpoint(1, 2, 0, "count > 1"), Breakpoint(2, 1, 0, "seen == []")
        proxy.setBreakpoints([kept, dropped])
        version.write(walker().replace("seen", "found"))
        report = proxy.reload()
        assert proxy.getBreakpoints() == [kept]
        (reported,) = [text for text in report.notKept if "breakpoint" in text]
        assert reported.startswith("a breakpoint is dropped: ")
        assert reported.endswith("the code of automaton 2 (b) uses no variable seen: there are found")


def test_a_component_that_stands_at_a_breakpoint_goes_on_from_there(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        proxy.setBreakpoints([Breakpoint(1, 2, 0, "")])
        proxy.sendEvent("go", "")
        before = first_snapshot(proxy, lambda snapshot: bool(snapshot.stoppedAt))
        version.write(walker(step=1000))
        proxy.reload()
        after = first_snapshot(proxy, lambda snapshot: snapshot.generation == 1)
        assert after.stoppedAt == before.stoppedAt
        assert (after.time, count(after)) == (before.time, count(before))
        proxy.step(1)
        assert count(proxy.getSnapshot()) == count(before) + 1000


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("def broken(:\n", r"walker.py:1: invalid syntax"),
        ("import nothing_of_this_name\n", "No module named"),
        ("raise SystemExit(3)\n", "SystemExit: 3"),
        ("", "does not define one component"),
        ("\x00", "null bytes"),
        (b"\xff\xfe\x00", "walker.py"),
    ],
)
def test_a_file_that_cannot_be_loaded_changes_nothing(
    pair: Pair, version: Version, text: str | bytes, reason: str
) -> None:
    with running(pair, version) as (runtime, proxy):
        before = in_b(proxy)
        component = runtime.component
        version.file.write_bytes(text.encode() if isinstance(text, str) else text)
        with pytest.raises(ReloadRefused, match=reason):
            proxy.reload()
        assert runtime.component is component
        after = first_snapshot(proxy, lambda snapshot: count(snapshot) > count(before) + 3)
        assert (after.generation, after.automata[0].state) == (0, 2)


@pytest.mark.parametrize(
    ("before", "after", "reason"),
    [
        (
            "count = 0",
            "count = 1 / 0",
            r"variables of the component failed: ZeroDivisionError.*line 1 of variables",
        ),
        ("initial=True", "initial=False", "exactly one initial state"),
        ("period=0.02", "period=-1", "a positive number of seconds"),
        ("                state_2,\n", "", "states that do not exist"),
        (
            "Automaton(\n            'walker'",
            "Automaton(\n            'runner'",
            "the file now defines runner, not walker",
        ),
    ],
)
def test_automata_that_make_no_sense_change_nothing(
    pair: Pair, version: Version, before: str, after: str, reason: str
) -> None:
    source = version.file.read_text()
    changed = source.replace(before, after).replace(before.replace("'", '"'), after.replace("'", '"'))
    assert changed != source
    with running(pair, version) as (_, proxy):
        version.file.write_text(changed)
        with pytest.raises(ReloadRefused, match=reason):
            proxy.reload()
        first_snapshot(proxy, lambda snapshot: snapshot.generation == 0 and count(snapshot) > 5)


def test_automata_for_which_no_thread_can_start_refuse_the_reload(
    pair: Pair, version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(thread: threading.Thread) -> None:
        if thread.name.startswith("automaton"):
            raise RuntimeError("can't start new thread")
        genuine(thread)

    genuine = threading.Thread.start
    more = sub(3, 2, state(1, "x", "hits += 1", initial=True), variables="hits = 0", period="20")
    with running(pair, version) as (_, proxy):
        version.write(
            walker(more=more).replace(
                "<name>red</name><idSubautomataSon>0", "<name>red</name><idSubautomataSon>3"
            )
        )
        with monkeypatch.context() as patch:
            patch.setattr(threading.Thread, "start", start)
            with pytest.raises(ReloadRefused, match="1 automata need a thread each: can't start new thread"):
                proxy.reload()
        before = first_snapshot(proxy, lambda snapshot: snapshot.generation == 0)
        first_snapshot(proxy, lambda snapshot: count(snapshot) > count(before) + 3)
        assert proxy.reload().generation == 1


def test_a_cycle_that_does_not_end_refuses_the_reload(pair: Pair, version: Version) -> None:
    version.write(
        walker(functions="def wait(self):\n    self.waiting = True\n    self.release.wait(240)\n").replace(
            "count += 1<", "count += 1; self.wait()<"
        )
    )
    release = threading.Event()
    with running(pair, version, RuntimeLimits(gap=0.2), release=release) as (runtime, proxy):
        try:
            first_snapshot(proxy, lambda snapshot: hasattr(runtime.component, "waiting"))
            version.write(walker())
            with pytest.raises(
                ReloadRefused, match=r"the cycle of walker in the state a did not end within 0\.4 s"
            ):
                proxy.reload()
        finally:
            release.set()
        assert 2 * LIMITS.gap == 1.0, "as the refusal says outside of tests"
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 3)
        assert proxy.reload().generation == 1


def test_code_that_sleeps_is_cut_so_that_it_is_reloaded(pair: Pair, version: Version) -> None:
    version.write(walker().replace("count += 1<", "count += 1; self.sleep(3600)<"))
    with running(pair, version) as (_, proxy):
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 0)
        version.write(walker())
        assert proxy.reload().generation == 1
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 5)


class Head(PoseHead):
    """A head that does not move."""

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        return self.getPose(current)

    def setSpeed(self, panSpeed: float, tiltSpeed: float, current: Current) -> HeadPose:
        return self.getPose(current)

    def stop(self, current: Current) -> None: ...

    def getPose(self, current: Current) -> HeadPose:
        return HeadPose(pan=0.25, tilt=0.0, panSpeed=0.0, tiltSpeed=0.0, time=0.0)

    def getLimits(self, current: Current) -> HeadLimits:
        raise NotImplementedError


def test_a_proxy_that_is_new_is_connected_before_anything_changes(
    endpoint: str, make_communicator: Callable[..., Communicator], version: Version
) -> None:
    server = make_communicator(listen=[endpoint], limits=HASTY)
    pair = Pair(endpoint, server, make_communicator(connect=[endpoint]), server.createObjectAdapter("Test"))
    pair.adapter.activate()
    looking = walker(config=HEAD).replace("count += 1<", "count = self.head.getPose().pan<")
    with running(pair, version) as (_, proxy):
        version.write(looking)
        with pytest.raises(ReloadRefused, match=r"self\.head: .*Head"):
            proxy.reload()
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 3)
        pair.adapter.add(Head(), "Head")
        assert proxy.reload().generation == 1
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].variables["count"] == "0.25")


def test_hand_written_code_beside_it_is_loaded_again(pair: Pair, version: Version) -> None:
    extension = version.directory / "walker_ext.py"
    text = "class WalkerExtension:\n    def bonus(self):\n        return {}\n"
    extension.write_text(text.format(1))
    document_text = walker(step=1).replace("count += 1<", "count += self.bonus()<")
    version.write(document_text)
    with running(pair, version) as (_, proxy):
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 3)
        extension.write_text(text.format(100000))
        proxy.reload()
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 100000)


@pytest.mark.parametrize("where", ["raise ValueError('bad')", "pass"], ids=["on making", "on loading"])
def test_a_reload_that_is_refused_leaves_the_hand_written_code_as_it_was(
    pair: Pair, version: Version, where: str
) -> None:
    extension = version.directory / "walker_ext.py"
    text = "BONUS = {}\nclass WalkerExtension:\n    def __init__(self):\n        super().__init__()\n        {}\n"
    extension.write_text(text.format(1, "pass"))
    asks = "import walker_ext\ncount += walker_ext.BONUS"
    version.write(walker(step=1).replace("count += 1<", f"{asks}<"))
    with running(pair, version) as (_, proxy):
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 3)
        extension.write_text(
            text.format(100_000, where) + ("raise ValueError('bad')\n" if where == "pass" else "")
        )
        with pytest.raises(ReloadRefused, match="bad"):
            proxy.reload()
        before = count(proxy.getSnapshot())
        first_snapshot(proxy, lambda snapshot: count(snapshot) > before + 3)
        assert count(proxy.getSnapshot()) < 100_000


def test_states_import_the_former_code_until_the_present_one_has_been_loaded(
    pair: Pair, version: Version
) -> None:
    extension, gate, begun = (version.directory / name for name in ("walker_ext.py", "gate", "begun"))
    gate.touch()
    waiting = (
        f"open({str(begun)!r}, 'a').close()\nwhile not os.path.exists({str(gate)!r}): time.sleep(0.01)\n"
    )
    text = f"import os, time\n{waiting}BONUS = {{}}\nclass WalkerExtension:\n    pass\n"
    extension.write_text(text.format(1))
    asks = "import walker_ext\ncount += walker_ext.BONUS"
    version.write(walker(step=1).replace("count += 1<", f"{asks}<"))
    with running(pair, version) as (_, proxy):
        gate.unlink()
        begun.unlink()
        extension.write_text(text.format(100_000))
        reload = proxy.reload.begin()
        try:
            until(begun.exists)
            before = count(proxy.getSnapshot())
            first_snapshot(proxy, lambda snapshot: before + 3 < count(snapshot) < 100_000)
        finally:
            gate.touch()
        assert reload.result(CALL_LIMIT).generation == 1
        first_snapshot(proxy, lambda snapshot: count(snapshot) > 100_000)


def test_two_reloads_at_once_are_one_reload_and_one_refusal(pair: Pair, version: Version) -> None:
    gate = version.directory / "gate"
    gate.touch()
    waiting = f"import os, time\nwhile not os.path.exists({str(gate)!r}): time.sleep(0.01)"
    version.write(walker().replace("count = 0", f"count = 0\n{waiting}"))
    with running(pair, version) as (_, proxy):
        gate.unlink()
        futures = [proxy.reload.begin(), proxy.reload.begin()]
        wait(futures, EVENT_LIMIT, FIRST_COMPLETED)  # the one that is refused
        gate.touch()
        outcomes = [future.exception(CALL_LIMIT) for future in futures]
        assert sorted(str(type(outcome).__name__) for outcome in outcomes) == ["NoneType", "ReloadRefused"]
        assert proxy.getSnapshot().generation == 1


def test_a_component_that_has_ended_is_not_reloaded(pair: Pair, version: Version) -> None:
    with running(pair, version) as (runtime, proxy):
        proxy.stop()
        assert runtime.ended.wait(EVENT_LIMIT)
        with pytest.raises(ReloadRefused, match="does not run"):
            proxy.reload()


def test_what_is_edited_within_a_second_to_the_same_size_counts(
    pair: Pair, version: Version, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)  # it is what would not see the edit

    def write(value: int) -> None:
        version.write(walker().replace("count += 1<", f"count = {value}<"))
        os.utime(version.file, (1_000_000_000, 1_000_000_000))

    write(100)
    with running(pair, version) as (_, proxy):
        for value in (200, 300):
            write(value)
            proxy.reload()
            first_snapshot(proxy, lambda snapshot, value=value: count(snapshot) == value)  # type: ignore[misc]


def test_what_guards_of_the_former_version_said_is_forgotten(pair: Pair, version: Version) -> None:
    version.write(walker().replace('type="event">go<', 'type="condition">count &lt; 0<'))
    with running(pair, version) as (_, proxy):
        first_snapshot(proxy, lambda snapshot: snapshot.automata[0].cycles > 3)
        proxy.pause()
        assert proxy.explain(1).transitions[0].reason.startswith("its guard `count < 0` was false")
        proxy.reload()
        assert (
            proxy.explain(1).transitions[0].reason
            == "its guard has not been evaluated since the state was entered"
        )
        proxy.step(1)
        assert proxy.explain(1).transitions[0].askedAt > 0


def test_what_follows_an_error_is_what_the_new_document_says(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        broken = walker().replace("count += 1<", "count += 1; missing()<")
        version.write(broken.replace("<VisualHFSM>", "<VisualHFSM><onerror>continue</onerror>"))
        proxy.reload()
        snapshot = first_snapshot(proxy, lambda snapshot: len(snapshot.errors) > 3)
        assert snapshot.status is ComponentStatus.Running


def test_errors_after_a_reload_point_into_the_new_document(pair: Pair, version: Version) -> None:
    with running(pair, version) as (_, proxy):
        version.write("\n" + walker().replace("count += 1<", "missing()<"))
        proxy.reload()
        snapshot = first_snapshot(proxy, lambda snapshot: bool(snapshot.errors))
        assert "NameError" in snapshot.errors[0].message
        assert "walker.xml:4" in snapshot.errors[0].location


def crowd(automata: int, step: int) -> str:
    """Return a document whose root owns some automata that run side by side."""
    below = "".join(f"<child>{number}</child>" for number in range(3, automata + 2))
    root = state(1, "all", initial=True, child=2).replace("<code>", f"{below}<code>")
    others = [
        sub(
            number, 1,
            state(1, "a", f"count += {step}", initial=True), state(2, "b", f"count += {step}"),
            transition(1, 1, 2, "count % 3 == 0"), transition(2, 2, 1, "20", type="time"),
            variables="count = 0", period="5",
        )
        for number in range(2, automata + 2)
    ]  # fmt: skip
    return document(
        sub(1, 0, root, transition(1, 1, 1, "again", type="event"), period="5"), *others, events=("again",)
    )


def test_whatever_is_asked_while_it_is_reloaded_it_goes_on(pair: Pair, tmp_path: Path) -> None:
    version = Version(tmp_path)
    version.write(crowd(6, 1))
    texts = []
    for number in range(2, 7):
        version.write(crowd(number, number))
        texts.append(version.file.read_text(encoding="utf-8"))
    chance = random.Random(7)
    with running(pair, version, RuntimeLimits(hand_over=FOREVER)) as (runtime, proxy):

        def threads() -> list[str]:
            return [thread.name for thread in threading.enumerate() if thread.name.startswith("automaton ")]

        before = threads()

        def reload() -> None:
            version.file.write_text(chance.choice(texts), encoding="utf-8")
            proxy.reload()

        def pause() -> None:
            proxy.pause()
            try:
                proxy.step(chance.randrange(8))
            finally:
                proxy.resume()

        def breaking() -> None:
            proxy.setBreakpoints([Breakpoint(2, 2, 0, "count > 3")])
            proxy.setBreakpoints([])
            proxy.resume()

        def ask(*asked: Callable[[], object]) -> None:
            for _ in range(60):
                with contextlib.suppress(NoSuchElement, InvalidValue, ReloadRefused):
                    chance.choice(asked)()

        groups = (
            (reload,),
            (pause, breaking),
            (
                lambda: proxy.forceTransition(chance.randrange(1, 8), 1),
                lambda: proxy.sendEvent("again", "1"),
                lambda: proxy.setVariable(chance.randrange(2, 8), "count", "0"),
            ),
            (lambda: proxy.explain(chance.randrange(1, 8)), proxy.getSnapshot, proxy.getStructure),
        )
        with ThreadPoolExecutor(len(groups)) as pool:
            for future in [pool.submit(ask, *group) for group in groups]:
                future.result(RUN_LIMIT)
        version.file.write_text(texts[-1], encoding="utf-8")
        assert proxy.reload().generation == runtime.reloads > 5
        cycles = [automaton.cycles for automaton in proxy.getSnapshot().automata]
        first_snapshot(
            proxy,
            lambda snapshot: all(
                now.cycles > then + 5 for now, then in zip(snapshot.automata, cycles, strict=True)
            ),
        )
        assert proxy.getSnapshot().errors == []
        until(lambda: len(threads()) == len(before))
