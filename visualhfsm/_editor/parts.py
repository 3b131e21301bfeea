"""The parts of the server: running, live data, robots, and the processes that read documents."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from visualhfsm._monitor.followers import Followers
from visualhfsm._monitor.messages import USUAL_LIMITS, PartLimits, Publish, free_endpoint, socket_endpoint
from visualhfsm._processes.components import StartedComponents
from visualhfsm._processes.robots import StartedRobot
from visualhfsm._processes.tests import StartedTests
from visualhfsm.project._check_process import CheckProcess
from visualhfsm.project._code_help.service import CodeHelp
from zenoh_ice.settings import Settings

from .protocol import VIEWS
from .views import Work, begun

_ANY_PORT: Final = Settings().listen


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts; the project gets `code_help` and `checks`, and closes them."""

    code_help: CodeHelp
    started: StartedComponents
    followers: Followers
    robot: StartedRobot
    tests: StartedTests
    views: Mapping[str, Work] = field(default_factory=dict)
    """What views do for documents, by their names."""
    checks: CheckProcess = field(default_factory=CheckProcess)


MakeParts = Callable[[Publish], Parts]
"""Creates the parts once the event loop runs; called on it."""


def make_parts(
    settings: Settings,
    include: Sequence[Path] = (),
    folder: Path | None = None,
    sockets: Path | None = None,
    *,
    limits: PartLimits = USUAL_LIMITS,
) -> MakeParts:
    """Return a factory of the parts of a realm, which the settings name.

    `include` are directories with packages of interfaces, `folder` is that of documents without a file, by
    default the current one. Components and robots that are started here connect to the editor, too, so that
    all of them find each other, whatever else runs on this machine. Unless the settings name endpoints, they
    meet at Unix sockets in the folder `sockets`, if that is given, and open no port.
    """

    def make(publish: Publish) -> Parts:
        listens_anywhere = settings.mode == "peer" and settings.listen == _ANY_PORT
        private = sockets if listens_anywhere else None
        others = () if private and "connect" not in settings.origins else settings.connect
        if private:
            listen: tuple[str, ...] = (socket_endpoint(private),)
        else:
            listen = (free_endpoint(),) if listens_anywhere else settings.listen
        meeting = settings.connect if settings.mode == "client" else listen
        robot = StartedRobot(
            publish, settings.override(connect=meeting), others, folder, private, limits=limits
        )
        return Parts(
            code_help=CodeHelp(include=include, folder=folder),
            started=StartedComponents(
                publish,
                settings.override(connect=tuple(dict.fromkeys((*meeting, *others)))),
                include,
                folder,
                private,
                limits=limits,
            ),
            followers=Followers(
                publish, settings.override(listen=listen, connect=others), robot.observe, limits=limits
            ),
            robot=robot,
            tests=StartedTests(publish, (folder or Path.cwd()).resolve(), include),
            views=begun(VIEWS, publish, include),
            checks=CheckProcess(folder=folder),
        )

    return make
