"""Guards that a test makes true or false, whatever their code returns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Final

from .._automaton import Transition
from ..tree import Actor, Tree
from .errors import UnknownName


class _SetGuard:
    """A guard with the value that a test sets; while that is None, its code decides."""

    def __init__(self, code: Callable[..., object]) -> None:
        self._code = code
        self.value: bool | None = None
        # The runtime finds the variables of an automaton through these.
        self.__closure__ = getattr(code, "__closure__", None)
        self.__code__ = getattr(code, "__code__", None)

    def __call__(self, *event: Any) -> object:  # noqa: ANN401 - that of the transition
        return self._code(*event) if self.value is None else self.value


class GuardTable:
    """The guards of a behavior, by name.

    The name of a guard is the path of its automaton, then the name of its transition (`followBall/red/lost`);
    any unique suffix will do (`red/lost`). The id distinguishes transitions of the same name: `lost#2`.
    """

    def __init__(self, tree: Tree) -> None:
        self._transitions: Final = dict(_named(tree))
        self.names: Final = tuple(self._transitions)

    def set(self, name: str, value: bool | None) -> None:
        """Set a guard; None lets its code decide again. Raises UnknownName."""
        transition = self._find(name)
        guard = transition.guard
        if not isinstance(guard, _SetGuard):
            assert guard is not None, "only transitions with a guard have a name here"
            guard = _SetGuard(guard)
            object.__setattr__(transition, "guard", guard)  # this structure belongs to this run alone
        guard.value = value

    def _find(self, name: str) -> Transition:
        if name in self._transitions:
            return self._transitions[name]
        found = [full for full in self._transitions if full.endswith(f"/{name}")]
        if len(found) == 1:
            return self._transitions[found[0]]
        known = ", ".join(found or self._transitions) or "none"
        what = "several guards are called" if found else "there is no guard"
        raise UnknownName(f"{what} {name!r}; there are {known}")


def path_of(actor: Actor) -> str:
    """Return the states that own an automaton, from the root down; empty for the root."""
    names = [each.owner.name for each in actor.chain() if each.owner is not None]
    return "/".join(reversed(names))


def _named(tree: Tree) -> Iterator[tuple[str, Transition]]:
    taken: set[str] = set()
    for actor in tree.actors:
        path = path_of(actor)
        names = [transition.name for transition in actor.automaton.transitions]
        for transition in actor.automaton.transitions:
            if transition.guard is None:
                continue
            unique = transition.name and names.count(transition.name) == 1
            name = transition.name if unique else f"{transition.name}#{transition.id}"
            full = f"{path}/{name}" if path else name
            if full in taken:  # several automata have the same path
                full = f"{full}@{actor.automaton.id}"
            taken.add(full)
            yield full, transition
