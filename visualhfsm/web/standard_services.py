"""The services of the command: which packages do the work beside the documents."""

from __future__ import annotations

from visualhfsm.live.service import Monitoring
from visualhfsm.running.service import RunningComponents
from zenoh_ice.settings import Settings

from .services import MakeServices, Publish, Services

__all__ = ["make_services"]


def make_services(settings: Settings) -> MakeServices:
    """Return what makes the services of a realm, given by the settings."""

    def make(publish: Publish) -> Services:
        return Services(running=RunningComponents(publish, settings), live=Monitoring(publish, settings))

    return make
