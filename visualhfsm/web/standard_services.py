"""The services of the command: which packages do the work beside the documents."""

from __future__ import annotations

from typing import Final

from visualhfsm.code_help.service import CodeHelper
from visualhfsm.live.service import Monitoring, free_endpoint
from visualhfsm.running.service import RunningComponents
from zenoh_ice.settings import Settings

from .services import MakeServices, Publish, Services

__all__ = ["make_services"]

_ANY_PORT: Final = Settings().listen


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
