"""Call an operation: read its arguments from the command line, and print what it returns.

One word for each parameter, in their order or as `name=VALUE`; or all of them as one JSON object.
"""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import typer

from nao_tools import NaoError
from nao_tools._connection import find_operation
from nao_tools._dynamic import DynamicProxy, target_of
from nao_tools._output import print_json, print_value
from nao_tools._values import FromJson, Json, is_bytes, to_json
from zenoh_ice import Communicator, initialize
from zenoh_ice.data import typed
from zenoh_ice.data.reflection import Member
from zenoh_ice.data.text import cut
from zenoh_ice.settings import Settings

_BY_NAME: Final = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)
_LARGEST_FILE: Final = 32 << 20  # bytes
_LONGEST_SHOWN: Final = 60  # characters of a wrong word in an error
_COMMAND: Final = "::jderobot::CommandRefusedException"  # thrown by the operations that move a robot
_ACTION: Final = "::nao::ActionState"  # what says how the newest walk, motion or posture goes
_CHECK_PERIOD: Final = 0.1  # s


def call(settings: Settings, address: str, words: Sequence[str], *, as_json: bool) -> None:
    """Call the operation that an address names with the arguments of the command line.

    A command to a robot lasts until the robot has come to rest, because its motion ends with this client.
    Raises NaoError for arguments that do not fit, and for a walk, a motion or a posture that ended early, and
    whatever the call raises.
    """
    with initialize(settings) as communicator:
        proxy, name = find_operation(communicator, address)
        maker = FromJson(proxy.schema, proxy.types, communicator.stringToProxy)
        arguments = _read_arguments(proxy, name, words, maker)
        if maker.left_out and sys.stderr.isatty():
            typer.secho(f"not given, so zero: {', '.join(maker.left_out)}", err=True, dim=True)
        moves = _COMMAND in proxy.operations[name].exceptions
        before = _progress(proxy) if moves else _Progress()
        results = proxy.invoke(name, arguments)
        result = next(iter(results.values())) if len(results) == 1 else results or None
        if as_json:
            print_json(to_json(result))
        elif results:
            print_value(to_json(result, shown_bytes))
        if moves:
            _wait_for_rest(communicator, proxy, before)


def _wait_for_rest(communicator: Communicator, commanded: DynamicProxy, before: _Progress) -> None:
    """Wait while a robot moves because this client commanded it. Raises NaoError if that ended early.

    `before` is how the walk, motion or posture before went.
    """
    untyped = communicator.stringToProxy("Safety")
    if not communicator.presence.interfaces(target_of(untyped)):
        return
    safety = DynamicProxy(untyped)
    if "isMoving" not in safety.operations:  # a server of a former release
        return
    sys.stdout.flush()
    now = _progress(commanded)
    # Who took the walk is known at the next correction of it.
    while safety.invoke("isMoving", [])["returnValue"] or (
        now.count == before.count + 1 and now.status == "Moving"
    ):
        time.sleep(_CHECK_PERIOD)
        now = _progress(commanded)
    if now.count > before.count + 1:
        raise NaoError("it ended early: another one began")
    if now.count > before.count and now.status in {"Stopped", "Failed"}:
        raise NaoError(f"it ended early: {now.message}")


class _Progress(msgspec.Struct):
    """How the newest walk, motion or posture goes."""

    count: int = 0
    status: str = ""
    message: str = ""


def _progress(commanded: DynamicProxy) -> _Progress:
    """Return how the newest walk, motion or posture goes, if the interface says it."""
    for name, of in commanded.operations.items():
        if not of.parameters and [each.type for each in of.results] == [_ACTION]:
            state = to_json(commanded.invoke(name, [])["returnValue"])
            try:
                return typed.convert(state, _Progress)
            except msgspec.ValidationError as error:
                raise NaoError(f"{name} does not say how an action goes: {error}") from None
    return _Progress()


def shown_bytes(data: bytes) -> Json:
    """Return the form in which bytes are shown to a person."""
    return f"<{len(data)} bytes>"


def _read_arguments(proxy: DynamicProxy, name: str, words: Sequence[str], maker: FromJson) -> list[object]:
    """Return the arguments of an operation; raises NaoError for words that do not fit the parameters."""
    parameters = proxy.operations[name].parameters
    given = _by_parameter(proxy, name, words)
    missing = [each.name for each in parameters if each.name not in given and not each.optional]
    if missing:
        as_well = " as well" if given else ""
        raise NaoError(f"{name} needs {', '.join(missing)}{as_well}: {proxy.signature(name)}")
    return [
        maker.member(each, given[each.name], each.name) if each.name in given else None for each in parameters
    ]


def _by_parameter(proxy: DynamicProxy, operation: str, words: Sequence[str]) -> dict[str, Any]:
    """Return the JSON value of each parameter that was given."""
    parameters = {each.name: each for each in proxy.operations[operation].parameters}
    if len(words) == 1 and (whole := _whole_object(proxy, parameters, words[0])) is not None:
        unknown = [name for name in whole if name not in parameters]
        if unknown:
            raise NaoError(f"{operation} has no parameter {unknown[0]!r}: {proxy.signature(operation)}")
        return whole
    given: dict[str, Any] = {}
    for word in words:
        match = _BY_NAME.fullmatch(word)
        if match and match[1] in parameters:
            name, text = match[1], match[2]
        else:
            name, text = next((each for each in parameters if each not in given), ""), word
        if not name:
            raise NaoError(f"{word!r} is one value too many: {proxy.signature(operation)}")
        if name in given:
            raise NaoError(f"{name} is given twice")
        given[name] = _read(proxy, parameters[name], text)
    return given


def _whole_object(proxy: DynamicProxy, parameters: dict[str, Member], word: str) -> dict[str, Any] | None:
    """Return the JSON object of all parameters, if the only word is one."""
    if not word.lstrip().startswith("{") or not parameters:
        return None
    try:
        value = json.loads(word)
    except (ValueError, RecursionError):
        return None  # the error is reported when the word is read as a value
    if not isinstance(value, dict) or len(parameters) > 1:
        return value if isinstance(value, dict) else None
    # For a single parameter it is the value, unless it can only mean {"parameter": value}.
    (parameter,) = parameters.values()
    if proxy.schema.kind(parameter.type) not in {"struct", "class"} or list(value) != [parameter.name]:
        return None
    members = [member.name for member in proxy.schema.definitions[parameter.type].members]
    return None if parameter.name in members else value


def _read(proxy: DynamicProxy, parameter: Member, text: str) -> Any:  # noqa: ANN401 - whatever JSON holds
    name, kind = parameter.name, parameter.type
    takes_bytes = is_bytes(proxy.schema, kind)
    if text.startswith("@"):
        data = _read_file(text[1:], name)
        if takes_bytes:
            return data
        text = data.decode("utf-8", "replace")
    is_enumerator = proxy.schema.kind(kind) == "enumeration"
    try:
        value = json.loads(text)
    except RecursionError:
        raise NaoError(f"{name}: nested too deeply") from None
    except ValueError:
        if kind == "string" or takes_bytes or is_enumerator or kind.endswith("*"):
            return text  # written without quotes
        wanted = proxy.schema.type_text(kind, scoped=False)
        raise NaoError(f"{name}: {cut(text, _LONGEST_SHOWN)!r} is not {wanted} as JSON") from None
    # A word such as `42` or `true` is a text where a text is wanted.
    return text if kind == "string" and not isinstance(value, str) else value


def _read_file(path: str, name: str) -> bytes:
    try:
        if path == "-":
            data = sys.stdin.buffer.read(_LARGEST_FILE + 1)
        else:
            with Path(path).open("rb") as file:
                data = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise NaoError(f"{name}: cannot read {path!r}: {error.strerror}") from error
    if len(data) > _LARGEST_FILE:
        raise NaoError(f"{name}: {path} has more than {_LARGEST_FILE >> 20} MiB")
    return data
