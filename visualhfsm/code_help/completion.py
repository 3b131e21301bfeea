"""What could follow in a piece of code, and what a call takes: jedi reads the module around the piece."""

from __future__ import annotations

import contextlib
import re
import sys
import time
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import jedi
import msgspec
from jedi.api.environment import InterpreterEnvironment

from .module import Synthetic
from .proxies import STREAM

__all__ = ["Completion", "Completions", "Explanation", "Signature", "complete", "explain", "signature"]

_MOST: Final = 200
_DOCUMENTED: Final = 24
_DOCUMENTATION_TIME: Final = 0.3
"""Seconds in which documentation is looked up; the rest goes without."""
_LONGEST: Final = 2000
_LONGEST_DETAIL: Final = 200
_CALLABLE: Final = frozenset({"class", "function"})
_STREAMED: Final = re.compile(rf"\bclass _(\w+){STREAM}\(")
_MADE_UP: Final = re.compile(r"\b_+Proxy\d+_\w*\.")
_OWN, _OUR, _INTERNAL = 2, 1, -1
_COMPONENT: Final = frozenset({"clock", "log", "mark", "send", "sleep"})
_CASTS: Final = frozenset({"checkedCast", "uncheckedCast"})
_KINDS: Final = {
    "class": "class",
    "function": "function",
    "instance": "variable",
    "keyword": "keyword",
    "module": "namespace",
    "param": "variable",
    "path": "text",
    "property": "property",
    "statement": "variable",
}

# Modules whose code would be run to be understood.
jedi.settings.auto_import_modules = []


class Completion(msgspec.Struct, frozen=True, omit_defaults=True):
    """Something that could follow; `type` is what CodeMirror calls it, `boost` moves it up in the list."""

    label: str
    type: str = ""
    detail: str = ""
    info: str = ""
    boost: int = 0


class Completions(msgspec.Struct, frozen=True, rename="camel"):
    """What could follow; what is typed of it already begins `typed` characters before the cursor."""

    typed: int
    options: list[Completion]


class Signature(msgspec.Struct, frozen=True, rename="camel"):
    """A call that is being typed: its parameters, and which of them the cursor is at, -1 for none."""

    name: str
    parameters: list[str]
    active: int
    result: str
    documentation: str


class Explanation(msgspec.Struct, frozen=True, rename="camel"):
    """What a name in the code stands for: its parameters with what it returns, and its documentation."""

    name: str
    detail: str
    documentation: str


def complete(module: Synthetic, path: Path, line: int, column: int) -> Completions:
    """Return what could follow, best first."""
    number, at = module.position(line, column)
    found = _script(module.source, path).complete(number, at)
    typed = found[0].get_completion_prefix_length() if found else 0
    text = module.source.split("\n")[number - 1][:at]
    before = text[: len(text) - typed]
    boosts = _Boosts(module.own_names, before)
    private = text[len(before) :].startswith("_")
    streams = frozenset(_STREAMED.findall(module.source))
    until = time.monotonic() + _DOCUMENTATION_TIME
    ranked = sorted(
        (each for each in found if private or not each.name.startswith("_")),
        key=lambda each: -boosts.of(each.name),
    )
    options = [
        _option(
            each,
            boost := boosts.of(each.name),
            streams,
            documented=boost >= 0 and rank < _DOCUMENTED and time.monotonic() < until,
        )
        for rank, each in enumerate(ranked[:_MOST])
    ]
    return Completions(typed, options)


def signature(module: Synthetic, path: Path, line: int, column: int) -> Signature | None:
    """Return the call around the cursor; None outside of calls."""
    found = _script(module.source, path).get_signatures(*module.position(line, column))
    if not found:
        return None
    call = found[0]
    text = call.to_string()
    return Signature(
        name=call.name.removesuffix(STREAM).removeprefix("_") if call.name.endswith(STREAM) else call.name,
        parameters=[_shown(each.to_string()) for each in call.params if each.name != "self"],
        active=-1 if call.index is None else call.index,
        result=_shown(text.rpartition(" -> ")[2]) if " -> " in text else "",
        documentation=_documentation(call),
    )


def explain(module: Synthetic, path: Path, line: int, column: int) -> Explanation | None:
    """Return what the name at a position stands for; None when there is nothing to say."""
    streams = frozenset(_STREAMED.findall(module.source))
    for found in _script(module.source, path).help(*module.position(line, column)):
        # As in completion, nothing else is inferred.
        stream = _stream_of(found) if found.type == "statement" and found.name in streams else None
        detail = _detail(found) if stream or found.type in _CALLABLE else ""
        documentation = "" if found.type == "keyword" else _documentation(stream or found)
        if detail or documentation:
            return Explanation(found.name, detail, documentation)
    return None


class _Boosts:
    """What stands first: what the document itself gives, then what each component has."""

    def __init__(self, own: frozenset[str], before: str) -> None:
        self._own = own if before.endswith("self.") or not before.endswith(".") else frozenset()
        self._our = _COMPONENT if before.endswith("self.") else frozenset()

    def of(self, name: str) -> int:
        """Return how far up a name is to stand."""
        if name in self._own:
            return _OWN
        if name in self._our:
            return _OUR
        behind = name in _CASTS or name.startswith("ice_")
        return _INTERNAL if behind else 0


def _option(found: Any, boost: int, streams: frozenset[str], *, documented: bool) -> Completion:  # noqa: ANN401 - jedi's
    kind, detail, info = _KINDS.get(found.type, ""), "", ""
    if documented:
        # Nothing else is inferred: what stands behind a variable may be all of numpy.
        stream = _stream_of(found) if found.type == "statement" and found.name in streams else None
        kind = "function" if stream else kind
        detail = _detail(found) if stream or found.type in _CALLABLE else ""
        info = _documentation(stream or found)
    return Completion(label=found.name, type=kind, detail=detail, info=info, boost=boost)


def _stream_of(found: Any) -> Any:  # noqa: ANN401
    """Return what stands for a streamed operation, None for anything else."""
    with contextlib.suppress(Exception):  # jedi stumbles over odd code in many ways
        for each in found.infer():
            if each.name == f"_{found.name}{STREAM}":
                return each
    return None


def _detail(found: Any) -> str:  # noqa: ANN401
    """Return the parameters of a function and what it returns."""
    with contextlib.suppress(Exception):
        signatures = found.get_signatures()
        if signatures:
            shown = _shown(str(signatures[0].to_string()))
            return shown[shown.find("(") :][:_LONGEST_DETAIL]
    return ""


def _documentation(found: Any) -> str:  # noqa: ANN401
    with contextlib.suppress(Exception):
        return str(found.docstring(raw=True))[:_LONGEST]
    return ""


def _shown(text: str) -> str:
    """Return a text of code without the names that only the module around the piece has."""
    return _MADE_UP.sub("", text)


def _script(source: str, path: Path) -> Any:  # noqa: ANN401
    script = jedi.Script(
        source,
        path=path.with_name("_being_typed.py"),
        project=_project(path.parent),
        environment=_environment(),
    )
    # Which branch of an `if` runs depends on more than jedi sees, and it would infer all conditions for that.
    script._inference_state.flow_analysis_enabled = False
    return script


@lru_cache(maxsize=8)
def _project(directory: Path) -> Any:  # noqa: ANN401
    # Compiled modules of the document's directory would be run to be looked into.
    return jedi.Project(
        directory,
        sys_path=[*sys.path, str(directory)],
        smart_sys_path=False,
        load_unsafe_extensions=False,
    )


@lru_cache(maxsize=1)
def _environment() -> Any:  # noqa: ANN401
    return InterpreterEnvironment()
