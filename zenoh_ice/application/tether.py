"""Become a command that ends when the process that started it ends, however that happens.

Run as a script by the launcher: `python tether.py LAUNCHER_PID background|foreground
COMMAND...`. The kernel's parent-death signal survives the exec, so that even a launcher killed with SIGKILL
takes its processes along. A separate program, because code between fork and exec inside the launcher would
be unsafe.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys

STDIN = 0
PR_SET_PDEATHSIG = 1
CANNOT_RUN = 127
"""Exit code of a command that does not exist or may not be run, as in a shell."""


def tie_to(launcher: int) -> None:
    """Handle the SIGINT that the launcher blocked until here, and die with it."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    die_with(launcher)


def die_with(launcher: int) -> None:
    """Ask the kernel for SIGTERM when the launcher dies; exit if it is dead already."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG) failed")
    if os.getppid() != launcher:
        sys.exit(128 + signal.SIGTERM)


def take_terminal() -> None:
    """Make this process group the terminal's foreground group, if the launcher's was.

    Ctrl-Z is ignored from here on: it would stop this process and leave the terminal without a reader.
    """
    if not os.isatty(STDIN) or os.tcgetpgrp(STDIN) != os.getpgid(os.getppid()):
        return
    signal.signal(signal.SIGTSTP, signal.SIG_IGN)
    # Until it owns the terminal this group is in the background, and asking for it would stop the process.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTTOU})
    os.tcsetpgrp(STDIN, os.getpgrp())
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTTOU})


def main() -> None:
    """Tie this process to the launcher and become the command."""
    launcher, place, *command = sys.argv[1:]
    # Python would turn an early SIGINT, which the launcher blocked until here, into a traceback.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    tie_to(int(launcher))
    if place == "foreground":
        take_terminal()
    try:
        os.execvp(command[0], command)  # noqa: S606 - there is nothing for a shell to do
    except OSError as error:
        sys.stderr.write(f"cannot run {command[0]}: {error.strerror}\n")
        sys.exit(CANNOT_RUN)


if __name__ == "__main__":
    main()
