"""The properties that a document states, checked while it runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Final

from codegen.hfsm.document import Property
from codegen.hfsm.model_checker.expressions import ExpressionError, parse
from codegen.hfsm.model_checker.model import Model, nanoseconds, read_model
from codegen.hfsm.model_checker.transition_system import ACTIVE, FINISHED, Holds
from hfsm_runtime.tree import Actor

from ._behavior import Behavior
from ._loading import DocumentInvalid, read

Check = tuple[str, Callable[[Behavior], object]]
"""A property in words, and a function that returns whether it holds."""


def stated_properties(document: Path) -> tuple[Stated, ...]:
    """Return the properties of a document. Raises DocumentInvalid."""
    return _stated(document, document.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _stated(path: Path, changed: int) -> tuple[Stated, ...]:  # noqa: ARG001 - read again when it was edited
    content = read(path)
    if not content.properties:
        return ()
    model = read_model(content, path)  # follows all code: as long as a second of a behavior takes
    return tuple(Stated(each, model) for each in model.document.properties)


class Stated:
    """A property that a document states, as the model checker understands it."""

    def __init__(self, stated: Property, model: Model) -> None:
        self._model: Final = model
        self._kind: Final = stated.kind.strip()
        self._within: Final = nanoseconds(stated.within)
        text = " ".join(stated.expression.text.split())
        self._name: Final = f"property {stated.name or text!r} ({self._kind} {text})"
        try:
            expression = parse(stated.expression.text, model)
        except ExpressionError as error:
            raise DocumentInvalid(f"{model.path}:{stated.line}: {self._name}: {error}") from error
        self._holds: Final[Holds] = expression.bind(
            {automaton.index: automaton.index for automaton in model.automata}
        )

    def start(self, b: Behavior) -> Check:
        """Return the check for a run."""
        runs = [b.tree.actor(automaton.source.id) for automaton in self._model.automata]
        seen = False

        def check(b: Behavior) -> bool:
            nonlocal seen
            now = round(b.time * 1e9)
            if seen or (self._within is not None and now > self._within and self._kind != "eventually"):
                return True
            holds = self._holds(tuple(self._local(index, run) for index, run in enumerate(runs)))
            if self._kind == "eventually":
                seen = holds
                return holds or self._within is None or now < self._within
            return holds is (self._kind == "always")

        return self._name, check

    def _local(self, index: int, run: Actor | None) -> tuple[int, int, int]:
        if run is None:
            return 0, 0, 0
        states = self._model.automata[index].states
        state = next(each.index for each in states if each.source.id == run.current.id)
        return state, (ACTIVE if run.active else 0) | (FINISHED if run.finished else 0), 0
