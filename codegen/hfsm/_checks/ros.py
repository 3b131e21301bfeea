"""Check the interfaces of ROS: their declarations, and how code uses them."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from typing import Final

from ...diagnostics import Location, Note, did_you_mean
from ..analysis import Access, Analysis
from ..codes import Code
from ..document import Document, RosInterface
from ..known_interfaces import Operation
from ..ros import FOLDERS, RosTypes, is_ros_name, parse_qos
from .attributes import check_call
from .report import Report

__all__ = ["ROS_OPERATIONS", "check_ros", "check_ros_uses"]

_TIMEOUT: Final = frozenset({"timeout"})
ROS_OPERATIONS: Final[Mapping[str, Mapping[str, Operation]]] = {
    "publish": {
        "publish": Operation("publish", ("message",), 0),
        "subscribers": Operation("subscribers", (), 0),
    },
    "subscribe": {
        "latest": Operation("latest", (), 0),
        "next": Operation("next", ("timeout",), 0),
        "value": Operation("value", (), 0),
    },
    "service": {
        "call": Operation("call", ("request",), 0, by_name=_TIMEOUT),
        "call_async": Operation("call_async", ("request",), 0),
        "wait": Operation("wait", ("timeout",), 0),
    },
    "action": {"send": Operation("send", ("goal",), 0, by_name=_TIMEOUT)},
}
"""What the attribute of each kind of interface offers."""
_ARE: Final = {
    "publish": "is published",
    "subscribe": "is subscribed",
    "service": "is a service",
    "action": "is an action",
}


def check_ros(document: Document, types: RosTypes, report: Report) -> None:
    """Check kinds, names, types and options; `check_component` checks the attributes' names."""
    by_target: dict[str, RosInterface] = {}
    for each in document.ros:
        if each.kind not in FOLDERS:
            message = f"the kind of `{each.name}` must be one of {', '.join(FOLDERS)}, not `{each.kind[:40]}`"
            report.error(Code.BAD_ROS_INTERFACE, message, each)
            continue
        if not is_ros_name(each.target.strip()):
            note = Note("write /scan, scan or ~/scan, with letters, digits and single _ between the slashes")
            message = f"`{each.target.strip()[:60]}` is not a name that ROS accepts"
            report.error(Code.BAD_ROS_NAME, message, each, [note])
        if problem := types.problem(each.type.strip(), each.kind):
            folder = FOLDERS[each.kind]
            where = f"beside the document, in a folder such as my_msgs/{folder}/"
            notes = [
                *did_you_mean(each.type.strip(), types.names(each.kind)),
                Note(f"its own types a project has in .{folder} files {where}"),
            ]
            report.error(Code.UNKNOWN_ROS_TYPE, problem, each, notes)
        _check_options(each, report)
        first = by_target.setdefault(f"{FOLDERS[each.kind]} {each.identity}", each)
        if first.type.strip() != each.type.strip():
            message = f"`{each.identity}` has the type `{each.type.strip()}` here and another one elsewhere"
            report.warning(Code.DIFFERENT_ROS_TYPES, message, each, [report.first(first)])


def _check_options(interface: RosInterface, report: Report) -> None:
    try:
        parse_qos(interface.qos.text)
    except ValueError as error:
        place = report.place(interface, interface.qos)
        report.error(Code.BAD_ROS_INTERFACE, f"the QoS of `{interface.name}`: {error}", place)
    stop = interface.stop.text.strip()
    if stop not in ("", "true", "false"):
        message = f"`stop` of `{interface.name}` must be `true` or `false`, not `{stop[:40]}`"
        report.error(Code.BAD_ROS_INTERFACE, message, report.place(interface, interface.stop))
    elif stop == "true" and interface.kind != "publish":
        message = (
            f"only what is published has a message at the stop: `{interface.name}` {_ARE[interface.kind]}"
        )
        report.error(Code.BAD_ROS_INTERFACE, message, report.place(interface, interface.stop))


def check_ros_uses(analysis: Analysis, types: RosTypes, report: Report) -> None:
    """Check each use of a ROS interface in code, and find those without any."""
    interfaces = {each.name: each for each in reversed(analysis.document.ros)}
    if not interfaces:
        return
    used = {access.name for access in analysis.accesses}
    used.update(alias.interface for name, alias in analysis.document.ros_aliases.items() if name in used)
    if analysis.extension is None:
        for name, interface in interfaces.items():
            if name not in used:
                message = f"`self.{name}` is never used"
                report.warning(Code.UNUSED_ROS_INTERFACE, message, interface)
    stored = {access.name for access in analysis.accesses if access.is_stored}
    for access in analysis.accesses:
        declared = interfaces.get(access.name)
        if declared is not None and access.name not in stored | analysis.defined and len(access.path) > 1:
            _check_use(access, declared, types, report)


def _check_use(access: Access, interface: RosInterface, types: RosTypes, report: Report) -> None:
    offered, name = ROS_OPERATIONS.get(interface.kind, {}), access.path[1]
    if name not in offered:
        message = (
            f"`{interface.name}` {_ARE[interface.kind]} and has no `{name}`: it has {', '.join(offered)}"
        )
        report.warning(Code.UNKNOWN_OPERATION, message, access.place(1), did_you_mean(name, offered))
    elif len(access.path) == 2 and access.call is not None:
        fields = types.fields(interface.type.strip(), name) if name in _TAKE_FIELDS else {}
        if fields is None:
            return
        operation = offered[name]
        operation = Operation(
            name, operation.parameters, operation.required, by_name=operation.by_name | fields.keys()
        )
        check_call(access, operation, report)
        for keyword in access.call.keywords:
            if keyword.arg in fields:
                _check_value(access, keyword.value, fields[keyword.arg], types, report)


_TAKE_FIELDS: Final = frozenset({"publish", "call", "call_async", "send"})


def _check_value(access: Access, value: ast.expr, type_name: str, types: RosTypes, report: Report) -> None:
    """Check the keys of a mapping that stands for a message."""
    fields = types.fields(type_name)
    if fields is None or not isinstance(value, ast.Dict):
        return
    for key, inner in zip(value.keys, value.values, strict=True):
        if not (isinstance(key, ast.Constant) and isinstance(key.value, str)):
            continue
        if key.value in fields:
            _check_value(access, inner, fields[key.value], types, report)
        else:
            place: Location = access.piece.place(key)
            message = f"`{type_name}` has no field `{key.value[:40]}`"
            notes = did_you_mean(key.value, fields) or [Note(f"it has {', '.join(fields)}")]
            report.warning(Code.BAD_CALL, message, place, notes)
