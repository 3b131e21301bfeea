"""The services: which packages do the work beside the documents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from visualhfsm.code_help.service import CodeHelper
from visualhfsm.live.service import Monitoring, free_endpoint
from visualhfsm.running.service import RunningComponents
from visualhfsm.services import Publish
from zenoh_ice.settings import Settings

__all__ = ["MakeServices", "Services", "make_services"]

_ANY_PORT: Final = Settings().listen


@dataclass(frozen=True, slots=True)
class Services:
    """What the server works with beside the documents."""

    code_help: CodeHelper
    running: RunningComponents
    live: Monitoring


MakeServices = Callable[[Publish], Services]
"""Makes the services once the event loop runs; called on it."""


def make_services(settings: Settings) -> MakeServices:
    """Return what makes the services of a realm, given by the settings.

    The components that are started here connect to the editor, too: it finds them without any robot.
    """

    def make(publish: Publish) -> Services:
        listens_anywhere = settings.mode == "peer" and settings.listen == _ANY_PORT
        listen = (free_endpoint(),) if listens_anywhere else settings.listen
        return Services(
            code_help=CodeHelper(),
            running=RunningComponents(publish, settings.override(connect=(*listen, *settings.connect))),
            live=Monitoring(publish, settings.override(listen=listen)),
        )

    return make
