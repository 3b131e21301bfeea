"""Additions of other packages to a seam: entry points of installed distributions, loaded when first needed.

ARCHITECTURE.md lists the seams; the package that asks has the protocol of what it gets.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

from zenoh_ice.data.text import text_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

_log = logging.getLogger(__name__)


class PluginError(Exception):
    """A plug-in is installed, and cannot be loaded; the message says which one, and what to do."""


@cache
def names(seam: str) -> tuple[str, ...]:
    """Return the names of what is installed for a seam, such as `naoserver.entrances`, without loading it."""
    return tuple(sorted({point.name for point in _points(seam)}))


@cache
def find(seam: str, name: str) -> Any | None:  # noqa: ANN401 - the caller knows what a seam takes
    """Return what a plug-in adds to a seam under a name; None if none does. Raises PluginError."""
    for point in _points(seam).select(name=name):
        if (found := _loaded(point)) is not None:
            return found
    return None


def each(seam: str) -> Iterator[tuple[str, Any]]:
    """Yield the name and what it stands for, of all that is installed for a seam.

    What cannot be loaded is named in the log: one plug-in keeps no other from working, and no command.
    """
    for name in names(seam):
        try:
            found = find(seam, name)
        except PluginError as error:
            _log.warning("%s", error)
        else:
            if found is not None:
                yield name, found


def _points(seam: str) -> EntryPoints:
    from importlib.metadata import entry_points  # loaded when first needed: it takes long

    return entry_points(group=seam)


def _loaded(point: EntryPoint) -> Any | None:  # noqa: ANN401
    try:
        return point.load()
    except ModuleNotFoundError as error:
        if error.name and point.module.split(".")[0] == error.name.split(".")[0]:
            return None  # removed since it was installed
        raise PluginError(_failure(point, error)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever somebody else's module raises, by `sys.exit`, too
        raise PluginError(_failure(point, error)) from error


def _failure(point: EntryPoint, error: BaseException) -> str:
    owner = point.dist.name if point.dist else "a package"
    why = text_of(error) or type(error).__name__
    return f"the plug-in {point.name} of {owner} ({point.value}) cannot be loaded: {why}"
