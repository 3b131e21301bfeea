"""Signals that end a command: they set an event or unwind a block that asks for it, or end the command at once."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.processes import ComponentProcess
from tests.support.soak import cases
from zenoh_ice.application.cli import stop_on_signals, unwind_on_signals

PROGRAM = """
import os, signal, sys, threading, time, typer
import zenoh_ice.application.cli
from zenoh.handlers import Callback
from zenoh_ice import ConfigurationException, initialize
from zenoh_ice.application.cli import run, stop_on_signals, unwind_on_signals

app = typer.Typer()

def strike(number=signal.SIGINT):
    os.kill(os.getpid(), number)

def say(text):
    print(text, flush=True)

@app.command()
def command() -> None:
    {body}

run(app)
"""

WAITING = """
    with stop_on_signals() as stop, initialize(connect=[], clock="wall"):
        threading.Timer(0.1, strike, [signal.{name}]).start()
        assert stop.wait(60)
        say(stop.signal)
    say("not said")
"""

OTHER_THREAD = """
    with stop_on_signals() as stop:
        threading.Timer(0.3, lambda: signal.pthread_kill(threading.get_ident(), signal.SIGINT)).start()
        stop.wait()
        say("cleaned up")
"""

IN_A_CALLBACK_OF_ZENOH = """
    def on_sample(_sample):
        strike()
        say("went on")

    with stop_on_signals() as stop, initialize(connect=[], clock="wall") as communicator:
        liveliness = communicator.transport.network.session.liveliness()
        token = liveliness.declare_token("strike")
        # This thread reports the history, inside of the call.
        handler = Callback(on_sample, indirect=False)
        subscriber = liveliness.declare_subscriber("strike", handler, history=True)
        stop.wait()
        subscriber.undeclare()
        token.undeclare()
"""

AGAIN = """
    with stop_on_signals() as stop:
        strike()
        stop.wait()
        strike(signal.SIGTERM)
        time.sleep(0.05)
        say("cleaned up")
"""

WHEREVER_IT_STRIKES = """
    def trace(frame, event, arg):
        code = frame.f_code
        if code.co_filename == threading.__file__ and (code.co_name, event) == ("{function}", "{event}"):
            sys.settrace(None)
            strike()
        return trace

    waited_for = threading.Event()
    with stop_on_signals() as stop:
        sys.settrace(trace)
        waited_for.wait(0.2)
        sys.settrace(None)
        stop.wait()
        waited_for.set()  # hangs if the signal left it locked
"""

HANGING = """
    with stop_on_signals(cleanup_limit=0.1) as stop:
        strike()
        stop.wait()
        time.sleep(0.2)
        threading.Timer(0.05, strike, [signal.SIGTERM]).start()
        time.sleep(60)
"""

LAST_MOMENT = """
    class Late:
        def __del__(self, kill=os.kill, process=os.getpid(), number=signal.SIGINT):
            kill(process, number)

    sys.late = Late()  # until Python has given up its handlers
    with stop_on_signals() as stop:
        strike(signal.SIGTERM)
        stop.wait()
"""

FAILING = """
    with stop_on_signals() as stop:
        strike()
        stop.wait()
        raise ConfigurationException("nothing was saved")
"""

OUTSIDE = """
    with stop_on_signals():
        pass
    threading.Timer(0.1, strike, [signal.{name}]).start()
    try:
        time.sleep(60)
    finally:
        say("not said")
"""

HANGUP_FIRST = """
    with stop_on_signals() as stop:
        strike(signal.SIGHUP)
        threading.Timer(0.1, strike, [signal.SIGTERM]).start()
        stop.wait()
        say(stop.signal)
"""

UNWOUND = """
    with unwind_on_signals():
        try:
            strike(signal.{name})
            time.sleep(60)
        finally:
            strike()  # by somebody who is in haste
            say("cleaned up")
    say("not said")
"""

HANGING_AS_IT_UNWINDS = """
    with unwind_on_signals(cleanup_limit=0.1):
        try:
            strike(signal.SIGTERM)
            time.sleep(60)
        finally:
            time.sleep(60)
"""

CODES = {"SIGHUP": 129, "SIGINT": 130, "SIGTERM": 143}
ONE_SIGNAL = pytest.mark.parametrize(
    ("name", "code"),
    cases([("SIGINT", 130)], [pytest.param("SIGHUP", 129), pytest.param("SIGTERM", 143)]),
)
"""That of each of them a wait hears, `test_a_signal_ends_a_wait_and_the_command_after_it` says."""


def command(body: str, **words: str) -> list[str]:
    return [sys.executable, "-c", PROGRAM.format(body=body.format(**words).strip())]


def end_of(body: str, **words: str) -> tuple[int, str, str]:
    """Return how a command ended: its exit code, and what it wrote to stdout and stderr."""
    ended = subprocess.run(
        command(body, **words), capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.parametrize(("name", "code"), CODES.items())
def test_a_signal_ends_a_wait_and_the_command_after_it(name: str, code: int) -> None:
    assert end_of(WAITING, name=name) == (code, f"{code - 128}\n", "")


def test_a_signal_that_strikes_another_thread_ends_a_wait() -> None:
    assert end_of(OTHER_THREAD) == (130, "cleaned up\n", "")


def test_a_signal_that_strikes_in_a_callback_of_zenoh_is_not_lost() -> None:
    assert end_of(IN_A_CALLBACK_OF_ZENOH) == (130, "went on\n", "")


@pytest.mark.parametrize(
    ("function", "event"), [("__enter__", "return"), ("__exit__", "call"), ("_acquire_restore", "call")]
)
def test_a_signal_leaves_nothing_locked_wherever_it_strikes(function: str, event: str) -> None:
    assert end_of(WHEREVER_IT_STRIKES, function=function, event=event) == (130, "", "")


def test_a_second_signal_does_not_break_off_the_cleaning_up() -> None:
    assert end_of(AGAIN) == (130, "cleaned up\n", "")


def test_a_second_signal_at_the_last_moment_changes_no_exit_code() -> None:
    assert end_of(LAST_MOMENT) == (143, "", "")


def test_a_signal_after_the_grace_ends_a_command_that_hangs() -> None:
    assert end_of(HANGING) == (143, "", "")


def test_an_error_after_a_signal_is_reported() -> None:
    code, _, err = end_of(FAILING)
    assert (code, err) == (1, "-c: error: nothing was saved\n")


@ONE_SIGNAL
def test_outside_of_a_block_a_signal_ends_a_command_at_once_and_quietly(name: str, code: int) -> None:
    assert end_of(OUTSIDE, name=name) == (code, "", "")


@ONE_SIGNAL
def test_a_block_that_is_unwound_cleans_up(name: str, code: int) -> None:
    assert end_of(UNWOUND, name=name) == (code, "cleaned up\n", "")


def test_a_command_that_hangs_as_it_unwinds_ends_after_the_grace() -> None:
    assert end_of(HANGING_AS_IT_UNWINDS) == (143, "", "")


def test_the_end_of_the_terminal_ends_nothing_under_nohup() -> None:
    with ComponentProcess(["nohup", *command(HANGUP_FIRST)]) as process:
        assert process.wait(RUN_LIMIT) == 143
        assert process.output.endswith("15\n")


@pytest.mark.parametrize("block", [stop_on_signals, unwind_on_signals])
def test_a_block_leaves_the_handlers_as_they_were(
    block: Callable[[], AbstractContextManager[object]],
) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with block():
        assert signal.getsignal(signal.SIGINT) is not before[0]
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
