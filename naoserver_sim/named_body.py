"""Find the body that a robot is to have: a known one, or a user's own.

A body whose parts come from a model is made by a plug-in, which is loaded for it alone.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from naoserver.bodies import find_body, is_body_file, is_of_model, read_body_file
from naoserver.body import Body
from naoserver.errors import RobotError
from zenoh_ice.plugins import NotInstalledError, optional

_NONE: Final[Mapping[str, str]] = {}

_log = logging.getLogger(__name__)


def named_body(
    name: str | Path,
    *,
    text: str | None = None,
    arguments: Mapping[str, str] = _NONE,
    say: Callable[[str], None] = _log.info,
) -> Body:
    """Return a known body by its name, or one's own by its file, whose xacro gets the arguments.

    `text` is what the file is to have, if not what it has. What a model alone was taken for is reported to
    `say`. Raises RobotError.
    """
    path = Path(name)
    if is_body_file(name) and is_of_model(path, text):
        body: Body = own_robots(path).read_own_body(path, text, arguments=arguments, say=say)
        return body
    if arguments:
        raise RobotError(f"{name}: it has no xacro, so that it takes no arguments")
    return read_body_file(path, text) if is_body_file(name) else find_body(str(name))


def own_robots(path: Path) -> Any:  # noqa: ANN401 - a plug-in, which the core may not import
    """Return what makes a body of the model of a user's file. Raises RobotError if it is not installed."""
    try:
        return optional("visualhfsm_own_robots", "visualhfsm[models]")
    except NotInstalledError as error:
        raise RobotError(f"{path}: models of robots are read by a plug-in: {error}") from None
