"""Signals that strike where they must not break anything off."""

from __future__ import annotations

import subprocess
import sys

from tests.support.limits import LIMIT

STRUCK_IN_A_CALLBACK = """
import os, signal, time, typer
from zenoh.handlers import Callback
from zenoh_ice import initialize
from zenoh_ice.command import run
from zenoh_ice.stop_signals import unbroken

app = typer.Typer()

@app.command()
def command() -> None:
    with initialize(connect=[], clock="wall") as communicator:
        token = communicator.session.liveliness().declare_token("strike")

        def strike(_sample: object) -> None:
            os.kill(os.getpid(), signal.SIGINT)
            print("went on", flush=True)

        # The history is told by this thread, inside of the call.
        subscriber = communicator.session.liveliness().declare_subscriber(
            "strike", Callback(unbroken(strike), indirect=False), history=True
        )
        try:
            time.sleep(60)
            print("never struck", flush=True)
        finally:
            subscriber.undeclare()
            token.undeclare()

run(app)
"""

STRUCK_ANOTHER_THREAD = """
import signal, threading, typer
from zenoh_ice import initialize
from zenoh_ice.command import run

app = typer.Typer()

def strike() -> None:
    signal.pthread_kill(threading.get_ident(), signal.SIGINT)

@app.command()
def command() -> None:
    with initialize(connect=[], clock="wall") as communicator:
        threading.Timer(0.3, strike).start()
        communicator.waitForShutdown()

run(app)
"""

STRUCK_IN_FOREIGN_CODE = """
import os, signal, typer
from zenoh_ice.command import run

app = typer.Typer()

@app.command()
def command() -> None:
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except SystemExit:
        raise SystemError("error return without exception set")  # as it comes out of Zenoh

run(app)
"""


def test_a_signal_that_strikes_in_a_callback_of_zenoh_is_not_lost() -> None:
    command = [sys.executable, "-c", STRUCK_IN_A_CALLBACK]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert (ended.returncode, ended.stdout) == (130, "went on\n"), ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_signal_that_strikes_another_thread_ends_a_wait_for_shutdown() -> None:
    command = [sys.executable, "-c", STRUCK_ANOTHER_THREAD]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert (ended.returncode, ended.stderr) == (130, "")


def test_a_signal_that_foreign_code_turned_into_another_error_still_ends_quietly() -> None:
    command = [sys.executable, "-c", STRUCK_IN_FOREIGN_CODE]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False)
    assert (ended.returncode, ended.stderr) == (143, "")
