"""Describe interfaces of ROS as Python that jedi understands: methods, and the fields of messages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

from codegen.hfsm.document import RosInterface
from visualhfsm_ros2._types import RosTypes

_PREFIX: Final = "_Ros_"
"""Completion does not offer names that begin with `_`."""
_PLAIN: Final = {"bool": "bool", "float32": "float", "float64": "float", "string": "str", "wstring": "str"}
_ARRAY: Final = re.compile(r"\[[^\]]*\]$")
_MOST_CLASSES: Final = 200
"""Classes of messages."""
_DECLARATION: Final = re.compile(r"^    (\w+) = Ros\(.*\)$", re.MULTILINE)
_COMPONENT: Final = re.compile(r'^class \w+\(.*Component, document=.*\n    """.*"""\n', re.MULTILINE)


def readable(component: str, interfaces: Sequence[RosInterface], types: RosTypes) -> str:
    """Return a generated component in which each interface has a class, `_Ros_NAME`, as its messages do."""
    if not interfaces:
        return component
    messages = _Messages(types)
    written = [line for each in interfaces for line in _ends(each, messages)]
    imports = ["from concurrent.futures import Future", "from zenoh_ros2 import Types"]
    classes = "\n".join([*imports, *messages.lines(), *written, ""])
    component = _DECLARATION.sub(rf"    \1: {_PREFIX}\1", component)
    return _COMPONENT.sub(lambda found: f"{classes}{found[0]}    ros: Types\n", component, count=1)


class _Messages:
    """The classes of messages, created when they are first named."""

    def __init__(self, types: RosTypes) -> None:
        self._types: Final = types
        self._fields: dict[str, dict[str, str]] = {}

    def name(self, type_name: str) -> str:
        """Return the class of a type as a .msg file writes it."""
        inner = _ARRAY.sub("", type_name)
        if inner != type_name:
            return f"list[{self.name(inner)}]"
        plain = inner.partition("<")[0]
        if "/" not in plain:
            return _PLAIN.get(plain, "int")
        if plain not in self._fields and len(self._fields) < _MOST_CLASSES:
            fields = self._types.fields(plain)
            self._fields[plain] = {}  # in case a message contains itself, which is invalid but not checked
            self._fields[plain] = {name: self.name(each) for name, each in (fields or {}).items()}
        return _PREFIX + re.sub(r"\W", "_", plain)

    def keywords(self, type_name: str) -> str:
        """Return the fields of a message as keyword parameters."""
        self.name(type_name)
        fields = self._fields.get(type_name, {})
        return "".join(f", {name}: {kind} = ..." for name, kind in fields.items())

    def lines(self) -> Iterator[str]:
        """Yield the classes."""
        for type_name, fields in self._fields.items():
            yield f"class {self.name(type_name)}:"
            yield f'    """{type_name}"""'
            yield from (f"    {name}: {kind}" for name, kind in fields.items())


def _ends(interface: RosInterface, messages: _Messages) -> Iterator[str]:
    """Yield the class of an attribute, and those of the results of its methods."""
    name, kind = interface.name, interface.type.strip()
    own = f"{_PREFIX}{name}"
    about = f"{interface.target.strip()} of ROS, {kind}".replace('"', "").replace("\\", "")
    if interface.kind == "subscribe":
        value = messages.name(kind)
        yield f"class {own}_Sample:"
        yield from (
            f"    {each}" for each in (f"value: {value}", "age: float", "sequence: int", "wall_time: float")
        )
        methods = [
            ("latest(self)", f"{own}_Sample", "Return the newest sample, None before any came."),
            ("next(self, timeout: float = 2.0)", f"{own}_Sample", "Wait for the next sample."),
        ]
        more = [f"value: {value}"]
    elif interface.kind == "publish":
        fields = messages.keywords(kind)
        given = f"self, message: {messages.name(kind)} = None, /"
        publish = f"publish({given}{', *' if fields else ''}{fields})"
        methods = [(publish, "None", "Publish a message, or one of some fields: the others are zero.")]
        more = ["subscribers: int"]
    elif interface.kind == "service":
        response = messages.name(f"{kind}_Response")
        given = f"self, request: {messages.name(f'{kind}_Request')} = None, /"
        fields = messages.keywords(f"{kind}_Request")
        methods = [
            (f"call({given}, *, timeout: float = 2.0{fields})", response, "Call the service."),
            (f"call_async({given}{', *' if fields else ''}{fields})", "Future", "Call without waiting."),
            ("wait(self, timeout: float = 2.0)", "None", "Wait until a server is there."),
        ]
        more = []
    else:
        yield f"class {own}_Goal:"
        yield from ("    status: int", f"    feedback: {messages.name(f'{kind}_Feedback')}", "    done: bool")
        yield f"    def result(self, timeout: float = 2.0) -> {messages.name(f'{kind}_Result')}:"
        yield '        """Wait for the end, and return the result."""'
        yield "    def cancel(self, timeout: float = 2.0) -> bool:"
        yield '        """Ask the server to cancel the goal."""'
        given = f"self, goal: {messages.name(f'{kind}_Goal')} = None, /, *, timeout: float = 2.0"
        sent = f"send({given}{messages.keywords(f'{kind}_Goal')})"
        methods = [(sent, f"{own}_Goal", "Send a goal, or one of some fields.")]
        more = []
    yield f"class {own}:"
    yield f'    """{about}"""'
    yield from (f"    {each}" for each in more)
    for signature, result, documentation in methods:
        yield f"    def {signature} -> {result}:"
        yield f'        """{documentation}"""'
