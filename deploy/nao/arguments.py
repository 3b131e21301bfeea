"""Read the arguments of a call from the command line.

One word for each parameter, in their order or as `name=VALUE`; or all of them as one JSON object.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from deploy.nao.definitions import Builtin, Member, Named, OperationSignature, Optional, Proxy, Type
from deploy.nao.definitions import Sequence as SequenceType
from deploy.nao.dynamic import DynamicProxy
from deploy.nao.errors import UsageError
from deploy.nao.values import FromJson

__all__ = ["read_arguments"]

_BY_NAME: Final = re.compile(r"([A-Za-z_]\w*)=(.*)", re.DOTALL)
_LARGEST_FILE: Final = 32 << 20


def read_arguments(
    proxy: DynamicProxy, operation: str, words: Sequence[str]
) -> tuple[list[object], list[str]]:
    """Return the arguments of an operation, and the paths of the members that nobody gave a value.

    Raises UsageError for words that do not fit the parameters.
    """
    signature = proxy.definitions.operations[operation]
    communicator = proxy.proxy.ice_getCommunicator()
    maker = FromJson(proxy.definitions, proxy.types, communicator.stringToProxy)
    given = _by_parameter(proxy, signature, words)
    missing = [
        each
        for each in signature.parameters
        if each.name not in given and not isinstance(each.type, Optional)
    ]
    if missing:
        as_well = " as well" if given else ""
        raise UsageError(f"{operation} needs {_listed(missing)}{as_well}: {signature}")
    arguments = [
        maker.make(each.type, given[each.name], each.name) if each.name in given else None
        for each in signature.parameters
    ]
    return arguments, maker.left_out


def _by_parameter(proxy: DynamicProxy, signature: OperationSignature, words: Sequence[str]) -> dict[str, Any]:
    """Return what JSON holds for each parameter that was given."""
    parameters = {each.name: each for each in signature.parameters}
    if len(words) == 1 and (whole := _whole_object(proxy, parameters, words[0])) is not None:
        unknown = [name for name in whole if name not in parameters]
        if unknown:
            raise UsageError(f"{signature.name} has no parameter {unknown[0]!r}: {signature}")
        return whole
    given: dict[str, Any] = {}
    in_order = iter(signature.parameters)
    for word in words:
        match = _BY_NAME.fullmatch(word)
        if match and match[1] in parameters:
            name, text = match[1], match[2]
        else:
            name, text = next((each.name for each in in_order if each.name not in given), ""), word
        if not name:
            raise UsageError(f"{word!r} is one value too many: {signature}")
        if name in given:
            raise UsageError(f"{name} is given twice")
        given[name] = _read(proxy, parameters[name].type, text, name)
    return given


def _whole_object(proxy: DynamicProxy, parameters: dict[str, Member], word: str) -> dict[str, Any] | None:
    """Return the JSON object of all parameters, if the one word that was given is that."""
    if not word.lstrip().startswith("{") or not parameters:
        return None
    try:
        value = json.loads(word)
    except ValueError:
        return None  # told when it is read as what it must be
    if not isinstance(value, dict):
        return None
    if len(parameters) > 1:
        return value
    (parameter,) = parameters.values()
    # Of a single parameter it is the value, unless it can only be meant as {"parameter": value}.
    record = (
        proxy.definitions.records.get(parameter.type.type_id) if isinstance(parameter.type, Named) else None
    )
    members = [member.name for member in record.members] if record else []
    is_wrapped = list(value) == [parameter.name] and record is not None and parameter.name not in members
    return value if is_wrapped else None


def _read(proxy: DynamicProxy, kind: Type, text: str, name: str) -> Any:  # noqa: ANN401 - whatever JSON holds
    if isinstance(kind, Optional):
        kind = kind.type
    is_bytes = kind == SequenceType(Builtin("byte"))
    if text.startswith("@"):
        data = _read_file(text[1:], name)
        if is_bytes:
            return data
        text = data.decode("utf-8", "replace")
    is_enumerator = isinstance(kind, Named) and kind.type_id in proxy.definitions.enumerations
    try:
        value = json.loads(text)
    except RecursionError:
        raise UsageError(f"{name}: nested too deeply") from None
    except ValueError:
        if kind == Builtin("string") or is_bytes or is_enumerator or isinstance(kind, Proxy):
            return text  # written without quotes
        raise UsageError(f"{name}: {_shortened(text)} is no {kind} as JSON") from None
    # A word such as `42` or `true` is a text where a text is wanted.
    return text if kind == Builtin("string") and not isinstance(value, str) else value


def _read_file(path: str, name: str) -> bytes:
    try:
        if path == "-":
            data = sys.stdin.buffer.read(_LARGEST_FILE + 1)
        else:
            with Path(path).open("rb") as file:
                data = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise UsageError(f"{name}: cannot read {path!r}: {error.strerror}") from error
    if len(data) > _LARGEST_FILE:
        raise UsageError(f"{name}: {path} has more than {_LARGEST_FILE >> 20} MiB")
    return data


def _listed(members: Sequence[Member]) -> str:
    return ", ".join(each.name for each in members)


def _shortened(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:60]}...")
