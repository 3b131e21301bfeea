"""Interfaces of ROS in documents: check their declarations, and how code uses them."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import Final

from codegen.diagnostics import Location, Note, did_you_mean
from codegen.hfsm.analysis import Access, Analysis
from codegen.hfsm.calls import check_call
from codegen.hfsm.codes import Code
from codegen.hfsm.document import Document, RosInterface
from codegen.hfsm.known_interfaces import Operation
from codegen.hfsm.report import Report
from codegen.messages import Message

from ._code_help import readable
from ._types import FOLDERS, QosError, RosTypes, is_ros_name, parse_qos, stops

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
    "publish": Message("is published"),
    "subscribe": Message("is subscribed"),
    "service": Message("is a service"),
    "action": Message("is an action"),
}


class Kind(RosTypes):
    """What documents use of ROS, as a kind of endpoints: see `codegen.hfsm.kinds`."""

    commands: Mapping[str, bool] = {
        **dict.fromkeys(("publish", "send"), True),
        **dict.fromkeys(("latest", "next", "value", "wait"), False),
    }

    def check(self, document: Document, report: Report) -> None:
        """Check kinds, names, types and options; `check_component` checks the attributes' names."""
        by_target: dict[str, RosInterface] = {}
        for each in document.ros:
            if each.kind not in FOLDERS:
                message = Message(
                    "the kind of `{name}` must be one of {known}, not `{kind}`",
                    name=each.name,
                    known=", ".join(FOLDERS),
                    kind=each.kind[:40],
                )
                report.error(Code.BAD_ROS_INTERFACE, message, each)
                continue
            if not is_ros_name(each.target.strip()):
                target = each.target.strip()[:60]
                message = Message("`{target}` is not a name that ROS accepts", target=target)
                known = Message(
                    "write /scan, scan or ~/scan, with letters, digits and single _ between the slashes"
                )
                report.error(Code.BAD_ROS_NAME, message, each, [Note(known)])
            if problem := self.problem(each.type.strip(), each.kind):
                own = Message(
                    "its own types a project has in .{kind} files beside the document, in a folder such as "
                    "my_msgs/{kind}/",
                    kind=FOLDERS[each.kind],
                )
                notes = [*did_you_mean(each.type.strip(), self.names(each.kind), "type"), Note(own)]
                report.error(Code.UNKNOWN_ROS_TYPE, problem, each, notes)
            _check_options(each, report)
            first = by_target.setdefault(f"{FOLDERS[each.kind]} {each.identity}", each)
            if first.type.strip() != each.type.strip():
                message = Message(
                    "`{identity}` has the type `{type}` here and another one elsewhere",
                    identity=each.identity,
                    type=each.type.strip(),
                )
                report.warning(Code.DIFFERENT_ROS_TYPES, message, each, [report.first(first)])

    def check_uses(self, analysis: Analysis, report: Report) -> None:
        """Check each use of a ROS interface in code, and find those without any."""
        interfaces = {each.name: each for each in reversed(analysis.document.ros)}
        if not interfaces:
            return
        used = {access.name for access in analysis.accesses}
        used.update(alias.interface for name, alias in analysis.document.ros_aliases.items() if name in used)
        if analysis.extension is None:
            for name, interface in interfaces.items():
                if name not in used:
                    message = Message("`self.{name}` is never used", name=name)
                    report.warning(Code.UNUSED_ROS_INTERFACE, message, interface)
        stored = {access.name for access in analysis.accesses if access.is_stored}
        for access in analysis.accesses:
            declared = interfaces.get(access.name)
            if declared is not None and access.name not in stored | analysis.defined and len(access.path) > 1:
                _check_use(access, declared, self, report)

    def can_generate(self, endpoint: RosInterface) -> bool:
        """Return whether an interface has a kind and a type that exist."""
        return endpoint.kind in FOLDERS and not self.problem(endpoint.type.strip(), endpoint.kind)

    def options(self, endpoint: RosInterface) -> dict[str, object]:
        """Return the quality of service of an interface, and whether its default message stops something."""
        stop = stops(endpoint.kind, endpoint.type.strip(), endpoint.stop.text.strip())
        return parse_qos(endpoint.qos.text) | ({"stop": True} if stop else {})

    def readable(self, component: str, endpoints: Sequence[RosInterface]) -> str:
        """Return a generated component with classes in place of the declarations of interfaces."""
        return readable(component, endpoints, self)


def _check_options(interface: RosInterface, report: Report) -> None:
    try:
        parse_qos(interface.qos.text)
    except QosError as error:
        place = report.place(interface, interface.qos)
        message = Message("the QoS of `{name}`: {error}", name=interface.name, error=error.message)
        report.error(Code.BAD_ROS_INTERFACE, message, place)
    stop = interface.stop.text.strip()
    if stop not in ("", "true", "false"):
        message = Message(
            "`stop` of `{name}` must be `true` or `false`, not `{stop}`", name=interface.name, stop=stop[:40]
        )
        report.error(Code.BAD_ROS_INTERFACE, message, report.place(interface, interface.stop))
    elif stop == "true" and interface.kind != "publish":
        message = Message(
            "only what is published has a message at the stop: `{name}` {is_what}",
            name=interface.name,
            is_what=_ARE[interface.kind],
        )
        report.error(Code.BAD_ROS_INTERFACE, message, report.place(interface, interface.stop))


def _check_use(access: Access, interface: RosInterface, types: RosTypes, report: Report) -> None:
    offered, name = ROS_OPERATIONS.get(interface.kind, {}), access.path[1]
    if name not in offered:
        message = Message(
            "`{interface}` {is_what} and has no `{name}`: it has {offered}",
            interface=interface.name,
            is_what=_ARE[interface.kind],
            name=name,
            offered=", ".join(offered),
        )
        report.warning(Code.UNKNOWN_OPERATION, message, access.place(1), did_you_mean(name, offered, ""))
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
            message = Message("`{type}` has no field `{name}`", type=type_name, name=key.value[:40])
            notes = did_you_mean(key.value, fields, "") or [
                Note(Message("it has {fields}", fields=", ".join(fields)))
            ]
            report.warning(Code.BAD_CALL, message, place, notes)
