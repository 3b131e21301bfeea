"""The services of the server: running, live data, robots, and the processes that read documents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from visualhfsm._monitor.messages import USUAL_LIMITS, Publish, ServiceLimits, free_endpoint, socket_endpoint
from visualhfsm._monitor.service import Monitoring
from visualhfsm._processes.components import RunningComponents
from visualhfsm._processes.robots import Robots
from visualhfsm._processes.tests import RunningTests
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.service import CodeHelp
from visualhfsm.trials._service import RunningTrials
from zenoh_ice.settings import Settings

_ANY_PORT: Final = Settings().listen


@dataclass(frozen=True, slots=True)
class Services:
    """The services; the project gets `code_help` and `checks`, and closes them."""

    code_help: CodeHelp
    running: RunningComponents
    live: Monitoring
    robots: Robots
    trials: RunningTrials
    tests: RunningTests
    checks: CheckProcess = field(default_factory=CheckProcess)


MakeServices = Callable[[Publish], Services]
"""Creates the services once the event loop runs; called on it."""


def make_services(
    settings: Settings,
    include: Sequence[Path] = (),
    folder: Path | None = None,
    sockets: Path | None = None,
    *,
    limits: ServiceLimits = USUAL_LIMITS,
) -> MakeServices:
    """Return a factory of the services of a realm, which the settings name.

    `include` are directories with packages of interfaces, `folder` is that of documents without a file, by
    default the current one. Components and robots that are started here connect to the editor, too, so that
    all of them find each other, whatever else runs on this machine. Unless the settings name endpoints, they
    meet at Unix sockets in the folder `sockets`, if that is given, and open no port.
    """

    def make(publish: Publish) -> Services:
        listens_anywhere = settings.mode == "peer" and settings.listen == _ANY_PORT
        private = sockets if listens_anywhere else None
        others = () if private and "connect" not in settings.origins else settings.connect
        if private:
            listen: tuple[str, ...] = (socket_endpoint(private),)
        else:
            listen = (free_endpoint(),) if listens_anywhere else settings.listen
        meeting = settings.connect if settings.mode == "client" else listen
        robots = Robots(publish, settings.override(connect=meeting), others, folder, private, limits=limits)
        return Services(
            code_help=CodeHelp(include=include, folder=folder),
            running=RunningComponents(
                publish,
                settings.override(connect=tuple(dict.fromkeys((*meeting, *others)))),
                include,
                folder,
                private,
                limits=limits,
            ),
            live=Monitoring(
                publish, settings.override(listen=listen, connect=others), robots.observe, limits=limits
            ),
            robots=robots,
            trials=RunningTrials(publish, include),
            tests=RunningTests(publish, (folder or Path.cwd()).resolve(), include),
            checks=CheckProcess(folder=folder),
        )

    return make
