"""Plug-ins, loaded when first needed: what others add to a seam, and what the core uses by its name.

Additions to a seam are entry points of installed distributions. ARCHITECTURE.md lists the seams; the package
that asks has the protocol of what it gets.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from zenoh_ice.data.text import text_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

KINDS: Final = "visualhfsm.kinds"
"""The seam of kinds of endpoints: each is a package, of which every part of the core asks for a module.

`documents` says what endpoints of documents mean (`codegen.hfsm.kinds`); `components` has their ends in a
running component, `names` what generated components import for them, and `options` options of a component's
command (`hfsm_runtime.kinds`); `graph` says what there is around a robot (`visualhfsm._monitor.graphs`).
"""

_log = logging.getLogger(__name__)


class PluginError(Exception):
    """A plug-in is installed, and cannot be loaded; the message says which one, and what to do."""


class NotInstalledError(PluginError):
    """A plug-in is not installed; the message says what installs it."""


def optional(package: str, install: str) -> Any:  # noqa: ANN401 - what the core may not import
    """Return a plug-in of this repository, a package, which comes with what is to `install`.

    Raises NotInstalledError.
    """
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        raise NotInstalledError(f"{package} is not installed; type: pip install '{install}'") from None


@cache
def names(seam: str) -> tuple[str, ...]:
    """Return the names of what is installed for a seam, such as `naoserver.entrances`, without loading it."""
    return tuple(sorted({point.name for point in _points(seam)}))


@cache
def find(seam: str, name: str, module: str = "") -> Any | None:  # noqa: ANN401 - the caller knows what a seam takes
    """Return what a plug-in adds to a seam under a name, or a module of the package that it adds.

    It is None if nobody adds it. Raises PluginError.
    """
    loaded = (_loaded(point, module) for point in _points(seam).select(name=name))
    return next((found for found in loaded if found is not None), None)


def each(seam: str, module: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the name and what `find` returns for it, of all that is installed for a seam.

    What cannot be loaded is named in the log: one plug-in keeps no other from working, and no command.
    """
    for name in names(seam):
        try:
            found = find(seam, name, module)
        except PluginError as error:
            _log.warning("%s", error)
        else:
            if found is not None:
                yield name, found


def _points(seam: str) -> EntryPoints:
    from importlib.metadata import entry_points  # loaded when first needed: it takes long

    return entry_points(group=seam)


def _loaded(point: EntryPoint, module: str) -> Any | None:  # noqa: ANN401
    try:
        return import_module(f"{point.value}.{module}") if module else point.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever somebody else's module raises, by `sys.exit`, too
        lacks = (isinstance(error, ModuleNotFoundError) and error.name) or ""
        if lacks.partition(".")[0] == point.module.partition(".")[0]:
            return None  # removed since it was installed
        owner = point.dist.name if point.dist else "a package"
        why = text_of(error) or type(error).__name__
        text = f"the plug-in {point.name} of {owner} ({point.value}) cannot be loaded: {why}"
        raise PluginError(text) from error
