"""Run random programs in virtual time, and see whether what happens refutes what the model checker claims."""

from __future__ import annotations

import random
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import hfsm_runtime as runtime
from codegen.hfsm.document import Automaton, Document, Text, Transition
from codegen.hfsm.model_checker import ModelReport, PropertyResult, Reachability, Verdict, check_model
from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor
from tests.support.random_python import Choices, Program
from visualhfsm.simulation._loading import DocumentInvalid, forget, load_component

__all__ = ["Found", "naive", "refuted", "shrunk"]

_PATH: Final = Path("drawn.xml")
_SECONDS: Final = 0.7
"""How long a program runs, in s of virtual time."""
_THREAD_LIMIT: Final = 5.0
"""How long a thread of a program may take, in s."""


class _Seen(Observer):
    """What happened: states, with the time in ns, and transitions, by the ids of automata and theirs."""

    def __init__(self) -> None:
        self.states: dict[tuple[int, int], int] = {}
        self.transitions: set[tuple[int, int]] = set()
        self.commanded = False
        """Whether the stand-in for the head was commanded, other than to stop."""
        self.error: BaseException | None = None

    def cycle_ended(self, actor: Actor, at: int) -> None:
        self.states.setdefault((actor.automaton.id, actor.current.id), at)

    def fired(self, actor: Actor, transition: runtime.Transition, at: int) -> None:
        self.transitions.add((actor.automaton.id, transition.id))

    def code_failed(self, actor: Actor, error: Exception) -> None:
        self.error = error

    def setSpeed(self, *_: object, **__: object) -> None:
        self.commanded = True

    def stop(self) -> None:
        pass


@dataclass(frozen=True)
class Found:
    """How many claims were made of a program, those that its run refutes, and why the run shows nothing, if so."""

    claims: int
    refuted: tuple[str, ...] = ()
    failed: str = ""


_Claims = list[tuple[str, Callable[[_Seen], bool]]]
"""Claims, each with whether what happened refutes it."""


def refuted(program: Program, *, checked: Document | None = None) -> Found:
    """Check a program, run it in virtual time, and return what happened against a claim.

    What is `checked` may be another document of the same states and transitions.
    """
    claims = _claims(program, check_model(checked or program.document, _PATH))
    if not claims:
        return Found(0)
    try:
        component = load_component(_PATH, content=program.document)
    except DocumentInvalid as error:
        return Found(len(claims), failed=f"{error}")
    try:
        seen = _run(component)
    except Exception as error:  # noqa: BLE001 - of any code: it voids the claims
        return Found(len(claims), failed=repr(error))
    finally:
        forget(component)
    if seen.error is not None:
        return Found(len(claims), failed=repr(seen.error))
    return Found(len(claims), tuple(claim for claim, is_refuted in claims if is_refuted(seen)))


def _claims(program: Program, report: ModelReport) -> _Claims:
    found: _Claims = []
    for one in report.states:
        if one.reachability is Reachability.IMPOSSIBLE:
            found.append(
                (f"#{one.automaton}/s{one.state} is never entered", _entered(one.automaton, one.state))
            )
    for each in report.transitions:
        if each.reachability is Reachability.IMPOSSIBLE:
            text = f"transition {each.transition} of #{each.automaton} never fires"
            found.append((text, _fired(each.automaton, each.transition)))
    found += [_held(each) for each in report.properties if each.verdict is Verdict.HOLDS]
    if program.aim == "command" and report.complete and not report.conflicts:
        found.append(("no other automaton commands Head", lambda seen: seen.commanded))
    return found


def _entered(automaton: int, state: int) -> Callable[[_Seen], bool]:
    return lambda seen: (automaton, state) in seen.states


def _fired(automaton: int, transition: int) -> Callable[[_Seen], bool]:
    return lambda seen: (automaton, transition) in seen.transitions


def _held(result: PropertyResult) -> tuple[str, Callable[[_Seen], bool]]:
    """Return that a property holds: one of states, that are never entered or one of which is, in time."""
    stated, text = result.property, result.property.expression.text
    states = {(int(one), int(other)) for one, other in re.findall(r"#(\d+)/s(\d+)", text)}
    claim = f"{stated.kind} {text} {stated.within.text}".strip() + " holds"
    if stated.kind == "never":
        return claim, lambda seen: bool(states & seen.states.keys())
    latest = float(stated.within.text) * 1e6
    return claim, lambda seen: all(seen.states.get(each, latest + 1) > latest for each in states)


def _run(component: type[runtime.Component]) -> _Seen:
    """Run a component in virtual time, and let its threads end in between."""
    random.seed(0)
    before, seen = set(threading.enumerate()), _Seen()
    made = component()
    vars(made)["Head"] = seen
    virtual = runtime.VirtualRun(made, on_error="continue", observers=[seen])
    for _ in range(round(_SECONDS / 0.1)):
        virtual.advance(0.1)
        for thread in set(threading.enumerate()) - before:
            thread.join(_THREAD_LIMIT)
    return seen


def naive(document: Document) -> Document:
    """Return a document as it looks to who does not read its code: all guards are one name or its opposite."""
    return replace(document, automata=tuple(map(_naive, document.automata)))


def _naive(one: Automaton) -> Automaton:
    nothing = Text("")
    return replace(
        one, functions=nothing, variables=nothing,
        states=tuple(replace(each, entry=nothing, code=nothing, exit=nothing, arguments=()) for each in one.states),
        transitions=tuple(replace(each, code=nothing, trigger=_naive_trigger(each)) for each in one.transitions),
    )  # fmt: skip


def _naive_trigger(one: Transition) -> Text:
    text = one.trigger.text
    if one.type != "condition" or text == "True":
        return one.trigger
    return Text("False" if "\n" in text else "not n" if text.startswith("not ") else "n")


def shrunk(made: Sequence[int], *, limit: int = 1500) -> list[int]:
    """Return simpler choices whose program still refutes a claim."""
    best, tries = list(made), 0
    is_better = True
    while is_better and tries < limit:
        is_better = False
        for candidate in _simpler(best):
            tries += 1
            choices = Choices(candidate)
            if refuted(Program(choices)).refuted and _size(choices.made) < _size(best):
                best, is_better = choices.made, True
                break
    return best


def _simpler(made: list[int]) -> Iterator[list[int]]:
    """Yield lists of choices without a part of others, and with a choice of what is plainer."""
    for size in (16, 8, 5, 3, 2, 1):
        for place in range(3, len(made) - size + 1):
            yield [*made[:place], *made[place + size :]]
    for place, number in enumerate(made):
        if number:
            yield [*made[:place], 0, *made[place + 1 :]]


def _size(made: list[int]) -> tuple[int, int]:
    return sum(map(bool, made)), len(made)
