"""The services of the command: which packages do the work beside the documents."""

from __future__ import annotations

from zenoh_ice.settings import Settings

from .services import MakeServices, Publish, Services

__all__ = ["make_services"]


def make_services(_settings: Settings) -> MakeServices:
    """Return what makes the services of a realm, given by the settings."""

    def make(_publish: Publish) -> Services:
        return Services()

    return make
