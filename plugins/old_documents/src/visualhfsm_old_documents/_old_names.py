"""Find the names that code uses and that only the generators of 2013 to 2018 provided.

A component gets such a name where its code uses it and nothing else defines it, whatever the layout of the
document: nothing has to be guessed about the editor that wrote it.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from typing import Final

from codegen.hfsm.code.former import FormerNames, Given
from codegen.hfsm.document import Document
from codegen.messages import Message

_LOCK: Final = "lock"
_OF_ALL: Final = Given("threading.Lock()", Message("a lock of all automata"))
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


def former_names(
    document: Document, *, mentioned: Set[str], own: Set[str], free: Set[str], imported: Set[str]
) -> FormerNames:
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
    if _LOCK in wanted:
        free = free | {_THREADING}
    missing = free - imported
    return FormerNames(
        modules={name: module for name, module in _MODULES.items() if name in missing},
        aliases=aliases,
        messages={name: full for name, full in document.ros_messages.items() if name in missing},
        clients={name: added for name, added in CLIENT_METHODS.items() if added & mentioned},
        attributes={_LOCK: _OF_ALL} if _LOCK in wanted else {},
        reserved=frozenset({_LOCK}),
    )
