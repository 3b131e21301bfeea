"""What a robot server keeps over its end: the emergency stop, and the lease."""

from __future__ import annotations

import os
import re
import socket
import stat
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

import pytest

from interfaces.nao import Severity
from naoserver.errors import CommandRefused, RobotError
from naoserver.safety._event_log import EventLog
from naoserver.safety._gate import LONGEST_LEASE, Gate
from naoserver.safety.latch import Latch, latch_of
from tests.support.limits import FOREVER
from tests.support.waiting import at_once
from zenoh_ice.application.kept_stop import UNREADABLE
from zenoh_ice.settings import Settings


@contextmanager
def server(path: Path, body: str = "") -> Iterator[Gate]:
    """A server's gate, until the server ends in good order; `body` is that of a simulated robot."""
    with Latch(path, body=body) as latch:
        yield gate_of(latch)


def gate_of(latch: Latch) -> Gate:
    return Gate(EventLog(lambda: 0.0, time.monotonic), latch)


def killed(path: Path, body: str = "") -> Gate:
    """Return the gate of a server that does not learn of its end, as when it is killed."""
    latch = Latch(path, body=body).__enter__()
    latch.release()
    return gate_of(latch)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "visualhfsm" / "robots" / "nao.json"


def test_at_first_and_after_an_orderly_end_commands_are_accepted(path: Path) -> None:
    for _ in range(2):
        with server(path) as gate:
            assert not gate.state().stopped
            gate.require("a")
    assert not path.exists()


def test_a_stop_outlasts_an_orderly_end_until_it_is_reset(path: Path) -> None:
    with server(path) as gate:
        gate.stop("a hand in the way")
    for _ in range(2):
        with server(path) as gate:
            assert gate.state().reason == "a hand in the way"
            with pytest.raises(CommandRefused, match="a hand in the way"):
                gate.require("a")
    with server(path) as gate:
        gate.reset()
        gate.require("a")
    with server(path) as gate:
        assert not gate.state().stopped


def test_after_an_end_without_warning_the_next_server_is_stopped_and_says_why(path: Path) -> None:
    killed(path)
    gate = killed(path)
    assert gate.state().reason == "its server ended without warning"
    (event,) = gate.events.snapshot()[0]
    assert event.level is Severity.Error
    assert "still stopped: its server ended without warning; reset the emergency stop" in event.message
    with server(path) as gate:
        assert gate.state().stopped, "however often it is started"
        gate.reset()
    with server(path) as gate:
        gate.require("a")


def test_a_stop_before_an_end_without_warning_keeps_its_reason(path: Path) -> None:
    killed(path).stop("smoke")
    expected = "smoke (then its server ended without warning)"
    assert killed(path).state().reason == expected
    assert killed(path).state().reason == expected


def test_a_server_that_was_killed_after_a_reset_is_stopped_for_its_end_alone(path: Path) -> None:
    gate = killed(path)
    gate.stop("smoke")
    gate.reset()
    with server(path) as gate:
        assert gate.state().reason == "its server ended without warning"


def reason(path: Path, body: str = "") -> str:
    """Return why a server starts stopped, which ends in good order."""
    with server(path, body) as gate:
        return gate.state().reason


def test_the_stop_of_a_simulated_robot_waits_for_it_while_others_are_free(path: Path) -> None:
    with server(path, "T1") as gate:
        gate.stop("smoke")
    assert [reason(path, body) for body in ("G1", "G1", "H25")] == ["", "", ""]
    with server(path, "G1") as gate:
        gate.stop("fire")
    assert [reason(path, body) for body in ("H25", "T1", "G1", "T1")] == ["", "smoke", "fire", "smoke"]
    with server(path, "T1") as gate:
        gate.reset()
    assert [reason(path, body) for body in ("T1", "G1", "T1")] == ["", "fire", ""]
    with server(path, "G1") as gate:
        gate.reset()
    assert not path.exists()


def test_a_simulated_robot_of_another_body_is_free_after_an_end_without_warning(path: Path) -> None:
    killed(path, "T1").acquire("a", "Ann", 30.0)
    with server(path, "G1") as gate:
        assert (gate.state().stopped, gate.state().holder) == (False, "")
    assert reason(path, "T1") == "its server ended without warning"


@pytest.mark.parametrize(
    "record",
    [b'{"running":false,"stop":"smoke","lease":null}', b'{"stop":"smoke","body":"","aside":{}}'],
    ids=["of an older release", "of a real robot"],
)
def test_the_stop_of_any_robot_holds_for_each_body_until_it_is_reset(path: Path, record: bytes) -> None:
    path.parent.mkdir(parents=True)
    path.write_bytes(record)
    assert [reason(path, body) for body in ("T1", "G1", "", "G1")] == ["smoke"] * 4
    with server(path, "T1") as gate:
        gate.stop("smoke again")
    with server(path, "G1") as gate:
        assert gate.state().reason.startswith("smoke")
        gate.reset()
        gate.stop("fire")
    assert [reason(path, body) for body in ("T1", "G1")] == ["", "fire"]


def test_a_real_robot_starts_stopped_after_any(path: Path) -> None:
    with server(path, "T1") as gate:
        gate.stop("smoke")
    assert [reason(path, body) for body in ("", "G1", "T1")] == ["smoke"] * 3


def test_a_record_that_cannot_be_read_counts_as_a_stop(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path.parent.mkdir(parents=True)
    for content, problem in (
        (b"", "Input data was truncated"),
        (b"{", "Input data was truncated"),
        (b'{"stop": 7}', "Expected `str`, got `int` - at `$.stop`"),
        (b'{"aside": ["T1"]}', "Expected `object`, got `array` - at `$.aside`"),
        (b"x" * 100_000, "JSON is malformed: invalid character (byte 0)"),
    ):
        path.write_bytes(content)
        caplog.clear()
        with Latch(path) as latch:
            gate = gate_of(latch)
            assert "cannot be read" in gate.state().reason
            assert caplog.messages[0] == f"{path}: {problem}"
            gate.reset()
        with server(path) as gate:
            assert not gate.state().stopped


def test_a_lease_outlasts_its_server_for_the_rest_of_its_time(path: Path) -> None:
    with server(path) as gate:
        gate.acquire("a", "Ann", 30.0)
    with server(path) as gate:
        assert gate.state().holder == "Ann"
        assert 25.0 < gate.state().remaining <= 30.0
        gate.require("a")
        with pytest.raises(CommandRefused, match="held by Ann"):
            gate.require("b")
        gate.release("a")
    with server(path) as gate:
        assert gate.state().holder == ""


@pytest.mark.parametrize("reason", ["", "smoke"])
def test_a_lease_outlasts_a_killed_server_too(path: Path, reason: str) -> None:
    gate = killed(path)
    gate.acquire("a", "Ann", 30.0)
    if reason:
        gate.stop(reason)
    gate = killed(path)
    assert (gate.state().stopped, gate.state().stops, gate.state().holder) == (True, 1, "Ann")


def test_the_last_moment_of_a_lease_counts_too(path: Path) -> None:
    with server(path) as gate:
        gate.acquire("a", "Ann", 0.9)
    with server(path) as gate:
        assert gate.state().holder == "Ann"


def test_a_record_that_somebody_removed_is_no_trouble(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with server(path):
        path.unlink()
    assert caplog.messages == []


def test_a_record_that_cannot_be_written_at_the_end_is_logged(
    path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with server(path) as gate:
        gate.stop("smoke")
        path.parent.rename(path.parent.with_name("away"))
    assert f"the emergency stop could not be kept in {path}" in caplog.messages


def test_a_kept_lease_ends_in_time_whatever_the_clock_of_the_machine_did(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = time.time()
    for later, holder in ((31.0, ""), (-1e6, "Ann")):
        with server(path) as gate:
            gate.acquire("a", "Ann", 30.0)
        with monkeypatch.context() as patch:
            patch.setattr(time, "time", lambda later=later: now + later)
            with server(path) as gate:
                state = gate.state()
                assert (state.holder, state.remaining <= LONGEST_LEASE) == (holder, True)


def test_a_server_that_cannot_keep_a_stop_does_not_begin(path: Path) -> None:
    path.parent.parent.write_text("no folder")
    with (
        pytest.raises(RobotError, match=r"cannot be kept in .*nao\.json: .*; set XDG_STATE_HOME to a"),
        Latch(path),
    ):
        pass


def test_a_stop_holds_while_the_disk_is_full_and_that_is_reported(path: Path) -> None:
    gate = killed(path)
    path.parent.rename(path.parent.with_name("away"))
    path.parent.write_text("nothing can be written there")
    gate.stop("smoke")
    assert gate.state().stopped
    assert "cannot be kept" in gate.events.snapshot()[0][-1].message
    gate.reset()
    gate.require("a")


def test_a_record_lies_in_the_directory_of_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    latch = latch_of(Settings(realm="red", listen=("tcp/127.0.0.1:7447",), connect=()))
    assert isinstance(latch, Latch)
    assert latch.path.parent == tmp_path / "visualhfsm" / "robots"
    assert re.fullmatch(r"red-[0-9a-f]{12}\.json", latch.path.name)


def test_a_user_without_a_directory_of_states_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setattr(Path, "home", homeless)
    expected = (
        "the emergency stop cannot be kept: no home: set XDG_STATE_HOME to a folder that can be written"
    )
    with pytest.raises(RobotError, match=f"^{expected}$"):
        latch_of(Settings(listen=("tcp/127.0.0.1:7447",), connect=()))


@pytest.mark.parametrize(
    ("identity", "name"), [(None, "red-e8b3881b7f66.json"), ("1f0c", "red-6c0ed677831a.json")]
)
def test_a_newer_server_finds_the_record_of_an_older_one(
    tmp_path: Path, identity: str | None, name: str
) -> None:
    """It has the same name in all versions: else a stop would be lost with an update."""
    machine = tmp_path / "machine-id"
    if identity is not None:
        machine.write_text(f"{identity}\n")
    settings = Settings(realm="red", listen=("tcp/[::]:7448", "tcp/127.0.0.1:7447"), connect=())
    latch = latch_of(settings, machine)
    assert isinstance(latch, Latch)
    assert latch.path.name == name


def test_machines_that_share_a_directory_have_separate_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = set()
    for content in ("1f0c", "2e7b", None):
        identity = tmp_path / f"machine-{content}"
        if content is not None:
            identity.write_text(f"{content}\n")
        latch = latch_of(Settings(listen=("tcp/127.0.0.1:7447",), connect=()), machine=identity)
        assert isinstance(latch, Latch)
        paths.add(latch.path)
    assert len(paths) == 3


def test_what_is_no_identity_counts_as_none(tmp_path: Path) -> None:
    paths = set()
    for content in (b"", "Übung".encode()):
        (tmp_path / "machine-id").write_bytes(content)
        settings = Settings(listen=("tcp/127.0.0.1:7447",), connect=())
        latch = latch_of(settings, machine=tmp_path / "machine-id")
        assert isinstance(latch, Latch)
        paths.add(latch.path)
    assert len(paths) == 1


def test_a_machine_with_another_name_finds_its_record(monkeypatch: pytest.MonkeyPatch) -> None:
    paths = set()
    for name in ("robotlab", "dhcp-7"):
        monkeypatch.setattr(socket, "gethostname", lambda name=name: name)
        latch = latch_of(Settings(listen=("tcp/127.0.0.1:7447",), connect=()))
        assert isinstance(latch, Latch)
        paths.add(latch.path)
    assert len(paths) == 1


def test_no_second_server_takes_the_record_of_one_that_runs(path: Path) -> None:
    with server(path) as gate:
        for _ in range(2):
            with pytest.raises(RobotError) as refusal, Latch(path, 0.0):
                pass
            assert str(refusal.value) == (
                f"another server of the same robot runs, and has {path}: end that one, or give this one another "
                "--realm"
            )
        gate.stop("smoke")
    with server(path) as gate:
        assert gate.state().reason == "smoke"


def test_nobody_else_can_lock_a_server_out(path: Path) -> None:
    mask = os.umask(0)
    try:
        with server(path):
            assert stat.S_IMODE(path.with_suffix(".lock").stat().st_mode) == 0o600
    finally:
        os.umask(mask)


@pytest.mark.parametrize("before", [None, 0o755])
def test_nobody_else_sees_who_holds_a_robot(path: Path, before: int | None) -> None:
    if before is not None:  # of an older release
        path.parent.mkdir(parents=True)
        path.parent.chmod(before)
    mask = os.umask(0)
    try:
        with server(path) as gate:
            gate.stop("smoke")
            modes = {each.name: stat.S_IMODE(each.stat().st_mode) for each in path.parent.iterdir()}
            assert modes == {"nao.json": 0o600, "nao.lock": 0o600}
            assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    finally:
        os.umask(mask)


def test_a_link_leads_no_server_to_another_lock(path: Path) -> None:
    path.parent.mkdir(parents=True)
    path.with_suffix(".lock").symlink_to("elsewhere")
    with pytest.raises(RobotError, match="cannot be kept"), Latch(path):
        pass
    assert not (path.parent / "elsewhere").exists()


def test_a_server_waits_for_the_end_of_the_one_before(path: Path) -> None:
    former = Latch(path).__enter__()
    former.keep("smoke", None)
    ending = threading.Timer(0.1, former.__exit__)
    ending.start()
    with Latch(path, FOREVER) as latch:
        assert latch.found.stop == "smoke"
    ending.join()


@pytest.mark.parametrize("name", ["nao.json", "nao.new", "nao.lock"])
@pytest.mark.parametrize("kind", ["folder", "pipe", "link", "file of somebody else"])
@at_once
def test_whatever_lies_in_its_place_no_server_starts_unstopped_or_waits(
    path: Path, name: str, kind: str
) -> None:
    path.parent.mkdir(parents=True)
    strange = path.with_name(name)
    if kind == "folder":
        strange.mkdir()
    elif kind == "pipe":
        os.mkfifo(strange)
    elif kind == "link":
        (path.parent / "elsewhere").write_text("{}")
        strange.symlink_to("elsewhere")
    else:
        if os.geteuid() != 0:
            pytest.skip("only root makes files of others")
        strange.write_text("{}")
        os.chown(strange, 1, 1)
    with suppress(RobotError), Latch(path) as latch:  # it may say that nothing can be kept there
        assert latch.found.stop == (UNREADABLE if name == "nao.json" else "")


def test_a_server_that_is_started_again_in_the_same_way_finds_its_record() -> None:
    def file(**settings: object) -> str:
        latch = latch_of(Settings(**settings))  # type: ignore[arg-type]
        assert isinstance(latch, Latch)
        return str(latch.path)

    default = file(listen=("tcp/127.0.0.1:7447",), connect=())
    assert default == file(listen=("tcp/127.0.0.1:7447",), connect=())
    assert default.startswith(os.environ["XDG_STATE_HOME"])
    behind_a_router = {"connect": ("tls/lab:7448",), "listen": ("tcp/127.0.0.1:0",)}
    others = (
        file(realm="red", listen=("tcp/127.0.0.1:7447",), connect=()),
        file(listen=("tcp/127.0.0.1:7448",), connect=()),
        file(**behind_a_router),
    )
    assert len({default, *others}) == 4
    assert file(**behind_a_router) == others[-1]
    with latch_of(Settings(listen=("tcp/127.0.0.1:0",), connect=())) as latch:
        assert latch is None


def test_a_server_finds_the_stop_of_its_body_or_as_a_real_robot_any(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    settings = Settings(listen=("tcp/127.0.0.1:7447",), connect=())

    def found(latch: Latch | nullcontext[None], stop: str = "") -> str:
        assert isinstance(latch, Latch)
        with latch:
            if stop:
                latch.keep(stop, None)
            return latch.found.stop

    assert found(latch_of(settings, body="T1"), "smoke") == ""
    assert found(latch_of(settings, body="G1")) == ""
    assert found(latch_of(settings, body="T1")) == "smoke"
    assert found(latch_of(settings)) == "smoke"


def test_who_commands_on_beside_a_kept_stop_is_refused_after_its_reset(path: Path) -> None:
    with server(path) as gate:
        gate.stop("smoke")
    with Latch(path) as latch:
        gate = Gate(EventLog(lambda: 0.0, lambda: 0.0), latch)
        with pytest.raises(CommandRefused, match="smoke"):
            gate.require("a")
        gate.reset()
        with pytest.raises(CommandRefused, match="ended the commands of a"):
            gate.require("a")
        gate.require("b")
