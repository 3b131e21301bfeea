"""Find the names that code uses and that only the generators of 2013 to 2018 provided.

A component gets such a name where its code uses it and nothing else defines it, whatever the layout of the
document: nothing has to be guessed about the editor that wrote it.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from typing import Final

from codegen.hfsm.document import Document

LOCK: Final = "lock"
"""An attribute of every component."""
_THREADING: Final = "threading"
_JDEROBOT: Final = {"jderobot": "interfaces.jderobot"}
_MODULES: Final = _JDEROBOT | {name: name for name in ("signal", "sys", _THREADING, "time", "traceback")}
"""Modules that the original generators imported, with what they are today."""
CLIENT_METHODS: Final[Mapping[str, frozenset[str]]] = {
    "jderobot::Motors": frozenset({"sendV", "sendW", "sendL"}),
    "jderobot::Pose3D": frozenset({"getPose3d"}),
    "jderobot::CMDVel": frozenset({"setVX", "setVY", "setVZ", "setYaw", "sendVelocities", "sendCMDVel"}),
}
"""The methods that JdeRobot's library for clients added to interfaces; `hfsm_runtime._jderobot` has them."""


@dataclass(frozen=True, slots=True)
class OldNames:
    """The former names that a component needs.

    `modules` are imported, each with its full name. `aliases` are attributes of the component, each with what
    it stands for, such as `motors` or `scanSub.value`. `messages` are types of ROS by their short name, and
    `clients` interfaces with methods of JdeRobot's library.
    """

    modules: Mapping[str, str] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    messages: Mapping[str, str] = field(default_factory=dict)
    clients: frozenset[str] = frozenset()
    has_lock: bool = False


def find_old_names(
    document: Document, *, mentioned: Set[str], own: Set[str], free: Set[str], imported: Set[str]
) -> OldNames:
    """Return the former names that the code of a document uses and that nothing else defines.

    The code has the attributes `mentioned`, and defines its `own`. It takes the `free` names from the file of
    the component, where libraries bind the `imported` ones.
    """
    declared = {each.name for each in (*document.all_interfaces, *document.parameters)}
    wanted = mentioned - own - declared
    aliases = {alias: name for alias, name in document.proxy_aliases.items() if alias in wanted}
    for alias, (interface, operation) in document.ros_aliases.items():
        if alias in wanted:
            aliases.setdefault(alias, f"{interface}.{operation}")
    has_lock = LOCK in wanted
    if has_lock:
        free = free | {_THREADING}
    missing = free - imported
    return OldNames(
        modules={name: module for name, module in _MODULES.items() if name in missing},
        aliases=aliases,
        messages={name: full for name, full in document.ros_messages.items() if name in missing},
        clients=frozenset(name for name, added in CLIENT_METHODS.items() if added & mentioned),
        has_lock=has_lock,
    )
