"""Completion and parameters of calls: jedi reads the module around a piece of code."""

from __future__ import annotations

import contextlib
import pickle
import sys
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import jedi
from jedi.api.environment import InterpreterEnvironment

from codegen.hfsm.code.names import COMPONENT_ALIASES

from .component import TypedComponent
from .prose import plain
from .protocol import Completion, Completions, Explanation, Signature

_MOST_PROPOSALS: Final = 200
_DOCUMENTED: Final = 24
_DOCUMENTATION_TIME: Final = 0.3
"""Seconds for looking up documentation; other options are explained on request."""
_TYPE_TIME: Final = 1.0
"""Seconds for inferring the kinds of names: all of numpy takes several."""
_LONGEST_DOCSTRING: Final = 8000
_LONGEST_DOCUMENTATION: Final = 2000
_LONGEST_DETAIL: Final = 200
_CALLABLE: Final = frozenset({"class", "function"})
_STUBS: Final = Path(__file__).parent / "stubs"
"""Stubs that jedi reads in place of modules that it does not understand."""
_OWN, _OUR, _INTERNAL = 2, 1, -1
_COMPONENT: Final = frozenset({"clock", "log", "mark", "send", "sleep"})
_HIDDEN: Final = ("_", "ice_")
"""Names with these prefixes are offered only after the prefix was typed."""
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

# Jedi would run the code of these modules.
jedi.settings.auto_import_modules = []


def complete(module: TypedComponent, path: Path, line: int, column: int) -> Completions:
    """Return the completions at a position, best first."""
    number, at = module.position(line, column)
    found = _ask(module, path, lambda script: script.complete(number, at))
    typed = found[0].get_completion_prefix_length() if found else 0
    text = module.source.split("\n")[number - 1][:at]
    before = text[: len(text) - typed]
    prefix = text[len(before) :]
    began = time.monotonic()
    ranked = sorted(
        (
            (boost, each)
            for each in found
            if not any(each.name.startswith(hidden) and not prefix.startswith(hidden) for hidden in _HIDDEN)
            and (boost := _boost(each, module, before)) is not None
        ),
        key=lambda each: -each[0],
    )
    options = [
        _option(each, boost, documented=boost >= 0 and rank < _DOCUMENTED, passed=time.monotonic() - began)
        for rank, (boost, each) in enumerate(ranked[:_MOST_PROPOSALS])
    ]
    return Completions(typed, options)


def signature(module: TypedComponent, path: Path, line: int, column: int) -> Signature | None:
    """Return the call around the cursor; None outside of calls."""

    def calls(script: Any) -> list[Signature]:  # noqa: ANN401 - jedi's
        found = script.get_signatures(*module.position(line, column))[:1]
        return [_signature(script, call) for call in found]

    return next(iter(_ask(module, path, calls)), None)


def _signature(script: Any, call: Any) -> Signature:  # noqa: ANN401 - jedi's
    named = script.help(call.bracket_start[0], max(0, call.bracket_start[1] - 1))
    called = named[-1] if named else call
    text = call.to_string()
    return Signature(
        name=called.name,
        parameters=[each.to_string() for each in call.params if each.name != "self"],
        active=-1 if call.index is None else call.index,
        result=text.rpartition(" -> ")[2] if " -> " in text else "",
        documentation=_documentation(called),
    )


def explain(module: TypedComponent, path: Path, line: int, column: int) -> Explanation | None:
    """Return the explanation of the name at a position, or None when there is none."""
    for found in _ask(module, path, lambda script: script.help(*module.position(line, column))):
        detail = _detail(found) if _type(found) in _CALLABLE else ""  # as in completion
        documentation = _documentation(found)
        if detail or documentation:
            return Explanation(found.name, detail, documentation)
    return None


def _boost(found: Any, module: TypedComponent, before: str) -> int | None:  # noqa: ANN401 - jedi's
    """Return the rank of a name after a text, None for a name that is useless there.

    Names of the document itself come first, then what every component has.
    """
    of_self = before.endswith("self.")
    if of_self or not before.endswith("."):
        if found.name in module.own_names:
            return _OWN
        if found.name in module.internal_names:
            return None
        if not before.strip() and _type(found) == "statement" and found.parent().type == "class":
            return None  # a member that the component could override
    if of_self and found.name in COMPONENT_ALIASES:
        return None  # for documents of other dialects
    if of_self and found.name in _COMPONENT:
        return _OUR
    return _INTERNAL if found.name in _CASTS else 0


def _option(found: Any, boost: int, *, documented: bool, passed: float) -> Completion:  # noqa: ANN401 - jedi's
    """Return a name with its details, `passed` s after the first one."""
    detail, info = "", ""
    if documented and passed < _DOCUMENTATION_TIME:
        # Nothing else is inferred: that of a variable may load all of numpy.
        detail = _detail(found) if _type(found) in _CALLABLE else ""
        info = _documentation(found)
    kind = _type(found) if passed < _TYPE_TIME else ""
    return Completion(found.name, _KINDS.get(kind, ""), detail, info, boost)


def _type(found: Any) -> str:  # noqa: ANN401 - jedi's
    """Return the kind of a name in the terms of jedi, which fails on some names of numpy."""
    with contextlib.suppress(Exception):
        return str(found.type)
    return ""


def _detail(found: Any) -> str:  # noqa: ANN401
    """Return the parameters and the result of a function."""
    with contextlib.suppress(Exception):
        signatures = found.get_signatures()
        if signatures:
            shown = str(signatures[0].to_string())
            return shown[shown.find("(") :][:_LONGEST_DETAIL]
    return ""


def _documentation(found: Any) -> str:  # noqa: ANN401
    """Return what a name is for, in sentences; nothing for keywords, for which jedi has whole chapters."""
    if _type(found) == "keyword":
        return ""
    with contextlib.suppress(Exception):
        return plain(str(found.docstring(raw=True))[:_LONGEST_DOCSTRING])[:_LONGEST_DOCUMENTATION]
    return ""


def _ask(module: TypedComponent, path: Path, question: Callable[[Any], list[Any]]) -> list[Any]:
    """Return the answers of jedi, none when it fails."""
    script = jedi.Script(
        module.source,
        path=path.with_name("_being_typed.py"),
        project=_project(path.parent, module.directories),
        environment=_environment(),
    )
    # Flow analysis would infer all conditions, though the branch that runs depends on more than jedi sees.
    # Without it jedi fails on an ellipsis in an annotation, with it on other odd code.
    for flow_analysis in (False, True):
        script._inference_state.flow_analysis_enabled = flow_analysis
        try:
            return question(script)
        except (EOFError, pickle.UnpicklingError, RecursionError):
            raise  # a broken file in its cache, or code that is nested too deeply: a new process helps
        except Exception:  # noqa: BLE001, S112 - jedi may raise anything
            continue
    return []


@lru_cache(maxsize=8)
def _project(directory: Path, packages: tuple[Path, ...]) -> Any:  # noqa: ANN401
    # Otherwise jedi would run compiled modules in the document's directory to inspect them.
    return jedi.Project(
        directory,
        sys_path=[str(_STUBS), *sys.path, str(directory), *map(str, packages)],
        smart_sys_path=False,
        load_unsafe_extensions=False,
    )


@lru_cache(maxsize=1)
def _environment() -> Any:  # noqa: ANN401
    return InterpreterEnvironment()
