"""Find the body that a robot is to have."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from naoserver.bodies import find_body, is_body_file
from naoserver.body import Body
from naoserver.errors import RobotError

_NONE: Final[Mapping[str, str]] = {}

_log = logging.getLogger(__name__)


def named_body(
    name: str | Path, *, arguments: Mapping[str, str] = _NONE, say: Callable[[str], None] = _log.info
) -> Body:
    """Return a known body by its name, or one's own by its file, whose xacro gets the arguments.

    What the file was taken for is reported to `say`. Raises RobotError.
    """
    if is_body_file(name):
        from naoserver_sim._own_body import read_own_body  # reads models: most robots are known

        return read_own_body(Path(name), arguments=arguments, say=say)
    if arguments:
        from naoserver_sim._own.xacro import NO_XACRO

        raise RobotError(f"{name}: {NO_XACRO}")
    return find_body(str(name))
