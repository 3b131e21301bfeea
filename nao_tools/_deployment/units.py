"""Write the processes of a stack as units of systemd.

They start in the order of the stack and are restarted by its policy, but not ended together. Processes
that need a terminal are left out: a user has to start them.
"""

from __future__ import annotations

import getpass
import json
import re
import shlex
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import typer

from nao_tools._deployment.stack import HOPELESS, STEADY, ProcessSpec, Stack, StackError, program_path

_HEADER: Final = "# Written by `nao stack`: change the stack and write it again."
_PLAIN: Final = re.compile(r"[\w@+=:,./-]+", re.ASCII)  # words that systemd takes as they stand

# Ten times what a simulation with a hundred clients needs. Components have a thread for each automaton.
_LIMITS: Final = """\
MemoryMax=2G
TasksMax=4096
LimitNOFILE=8192
"""

# Without what our programs need: devices (a GPU), memory that is written and executed (Mesa's compiler), the
# home directory (the stack may be there) and the temporary files of others.
_SANDBOX: Final = """\
NoNewPrivileges=yes
CapabilityBoundingSet=
LockPersonality=yes
ProtectControlGroups=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
ProtectSystem=full
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
RestrictNamespaces=yes
RestrictSUIDSGID=yes
SystemCallArchitectures=native
"""


def write(stack: Stack, changes: dict[str, str], folder: Path) -> None:
    """Write the processes of a stack as systemd units into a folder, and say what to do with them.

    Raises StackError for a variable that the stack does not have, and when a file cannot be written.
    """
    processes = stack.with_variables(changes)
    for process in processes:
        if process.foreground:
            typer.echo(f"left out, since it needs a terminal: {shlex.join(process.command)}")
    for path in write_units(stack.name, processes, folder):
        typer.echo(f"wrote {path}")
    typer.echo(
        f"next: sudo cp {shlex.quote(str(folder))}/{stack.name}*.* /etc/systemd/system/"
        f" && sudo systemctl daemon-reload && sudo systemctl enable --now {stack.name}.target"
    )


def write_units(name: str, processes: Sequence[ProcessSpec], folder: Path) -> list[Path]:
    """Write a service of systemd for each process of a stack, and a target that starts all; return the files.

    They are units of the system that run as the present user in the present directory. One that has failed
    for good starts the template `NAME-alert@.service`. Raises StackError when a file cannot be written, or is
    not one that this function wrote.
    """
    background = _background(name, processes)
    services = {spec.name: f"{name}-{spec.name}.service" for spec in background}
    target = f"{_HEADER}\n[Unit]\nDescription=Stack {name}\nWants={' '.join(services.values())}\n"
    units = {f"{name}.target": f"{target}\n[Install]\nWantedBy=multi-user.target\n"}
    units[f"{name}-alert@.service"] = _alert(name)
    for spec in background:
        after = [services[other] for other in spec.after if other in services]
        units[services[spec.name]] = _service(name, spec, after)
    return [_write(folder / unit, text) for unit, text in units.items()]


def _alert(name: str) -> str:
    return f"""{_HEADER}
# It writes to the journal. To notify somebody: systemctl edit {name}-alert@.service
[Unit]
Description=Alert that %i has failed

[Service]
Type=oneshot
ExecStart=/bin/echo "<1>%i has failed and is not started again: see journalctl -u %i"
"""


def _service(name: str, spec: ProcessSpec, after: Sequence[str]) -> str:
    program, *arguments = spec.command
    path = program_path(program)
    words = [shutil.which(path) or path, *arguments]
    environment = {"PYTHONUNBUFFERED": "1", **spec.environment}
    pairs = " ".join(_word(f"{key}={value}") for key, value in environment.items())
    # A minute without failure resets the launcher's count; systemd counts starts within an interval.
    window = (spec.restart_limit + 1) * (STEADY + spec.restart_pause + spec.ready_timeout)
    # The dead man's switch of a robot's server outlives a killed one for a moment, to stop the robot.
    kill_mode = "process" if spec.watchdog else "mixed"
    watchdog = f"WatchdogSec={spec.watchdog:g}\n" if spec.watchdog else ""
    return f"""{_HEADER}
[Unit]
Description={spec.name} of stack {name}
PartOf={name}.target
Wants={" ".join(["network-online.target", *after])}
After={" ".join(["network-online.target", "time-sync.target", *after])}
StartLimitIntervalSec={window:g}
StartLimitBurst={spec.restart_limit + 1}
OnFailure={name}-alert@%n.service

[Service]
Type={"notify" if spec.notify else "exec"}
NotifyAccess=all
User={getpass.getuser()}
WorkingDirectory={str(Path.cwd()).replace("%", "%%")}
Environment={pairs}
ExecStart={" ".join(_word(word).replace("$", "$$") for word in words)}
KillMode={kill_mode}
KillSignal=SIGINT
TimeoutStartSec={spec.ready_timeout:g}
TimeoutStopSec={2 * spec.stop_timeout:g}
SuccessExitStatus=130 143
Restart={"no" if spec.restart == "never" else spec.restart}
RestartSec={spec.restart_pause:g}
RestartPreventExitStatus={" ".join(map(str, sorted(HOPELESS)))}
{watchdog}{_LIMITS}{_SANDBOX}"""


def _word(text: str) -> str:
    """Return a text as one word of a command in a unit, without what a `$` may mean there."""
    text = text.replace("%", "%%")
    return text if _PLAIN.fullmatch(text) else json.dumps(text, ensure_ascii=False)


def _background(name: str, processes: Sequence[ProcessSpec]) -> list[ProcessSpec]:
    background = [spec for spec in processes if not spec.foreground]
    if not background:
        raise StackError(f"{name}: all of it needs a terminal: start it with `nao stack`")
    return background


def _write(path: Path, text: str) -> Path:
    try:
        if path.exists() and not path.read_text("utf-8", "replace").startswith(_HEADER):
            raise StackError(f"{path}: was not written by `nao stack`: delete it, or write elsewhere")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    except OSError as error:
        raise StackError(f"{path}: cannot be written: {error.strerror}") from error
    return path
