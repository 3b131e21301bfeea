"""Analyze one automaton: its pieces of code, its inputs, and what its states hand to the automata below."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from ...diagnostics import Diagnostics, Location, Note, did_you_mean
from ..checks import delay, milliseconds
from ..code.literals import literal
from ..code.python import analyze_block, analyze_condition, analyze_expression, global_names
from ..code.reader import CodeReader
from ..code.scopes import local_names
from ..code.text import Code
from ..code.values import INPUT_TYPES, ValueTextError, parse_value
from ..codes import Code as DocumentCode
from ..document import NO_CHILD, Argument, Automaton, Parameter, State, Text, Transition
from ..program import ArgumentProgram, AutomatonProgram, InputProgram, StateProgram, TransitionProgram

__all__ = ["AutomatonAnalysis"]

_T = TypeVar("_T")

_NEVER = Code(lines=("False",), line=0, is_expression=True)
"""What stands for a condition that is not written yet; the origin's generated code took it so."""

_EVENT = "event"
"""What guard and code of a transition by an event call the event."""


class AutomatonAnalysis:
    """Analyze one automaton; what is wrong with its code is told by the reader of the code.

    `automata` are all automata by id, and `reserved` are names that no code may assign.
    """

    def __init__(
        self,
        automaton: Automaton,
        automata: Mapping[int, Automaton],
        *,
        path: Path,
        reserved: frozenset[str],
        reader: CodeReader,
        diagnostics: Diagnostics,
    ) -> None:
        self._automaton = automaton
        self._automata = automata
        self._path = automaton.path or path
        self._reserved = reserved
        self._reader = reader
        self._diagnostics = diagnostics

    def program(self, owner: State | None, file: str) -> AutomatonProgram:
        """Return the program of the automaton, which is of use when no error was reported.

        `owner` is the state above it, `file` the name of the file that it stands in.
        """
        automaton = self._automaton
        variables = self._read(
            lambda text: analyze_block(text, returns=False),
            f"the variables of automaton {automaton.id}",
            automaton.variables,
        )
        bound = variables.bound if variables else frozenset()
        inputs = tuple(self._inputs(bound, owner))
        program = AutomatonProgram(
            automaton=automaton,
            owner=owner,
            source=file if automaton.path else "",
            period=(milliseconds(automaton.iteration_time) or 0.0) / 1000,
            inputs=inputs,
            variables=variables,
            states=tuple(self._states()),
            transitions=tuple(self._transition(transition) for transition in automaton.transitions),
        )
        for piece in (*program.pieces(), *((variables,) if variables else ())):
            for name in sorted(self._reserved & piece.bound):
                message = f"`{name}` is a name that the component needs: choose another"
                self._error(DocumentCode.RESERVED_NAME, message, piece.line, 1)
        shared = {item.name for item in inputs}.union(*(piece.bound for piece in program.pieces()))
        for name, line in (global_names(variables) if variables else {}).items():
            if name in shared:
                message = (
                    f"`global {name}` makes `{name}` a name of the whole file, and other code of the "
                    "automaton assigns its own: strike it here, or say it there, too"
                )
                self._error(DocumentCode.BAD_CODE, message, line, 1)
        return _with_local_names(program)

    def _states(self) -> Iterator[StateProgram]:
        states = self._automaton.states
        initial = next((state for state in states if state.initial), states[0] if states else None)
        for state in states:
            label = f"state `{state.name}`" if state.name.strip() else f"state {state.id}"
            yield StateProgram(
                state=state,
                initial=state is initial,
                entry=self._block(f"the entry code of {label}", state.entry),
                code=self._block(f"the code of {label}", state.code),
                exit=self._block(f"the exit code of {label}", state.exit),
                children=tuple(child for child in state.children if child in self._automata),
                restart=state.history.text.strip() == "restart",
                arguments=tuple(self._arguments(state, label)),
            )

    def _transition(self, transition: Transition) -> TransitionProgram:
        label = (
            f"transition `{transition.name}`" if transition.name.strip() else f"transition {transition.id}"
        )
        kind = transition.type
        guard: Code | None = None
        if kind == "condition" and transition.trigger.is_blank:
            message = f"{label} has no condition: it never fires"
            self._diagnostics.warning(DocumentCode.NO_CONDITION, message, self._place(transition))
            guard = replace(_NEVER, line=transition.trigger.line)
        elif kind == "condition":
            guard = self._read(analyze_condition, f"the condition of {label}", transition.trigger)
        elif not transition.guard.is_blank:
            guard = self._read(analyze_condition, f"the guard of {label}", transition.guard)
        code = self._block(f"the code of {label}", transition.code)
        if kind == "event":  # a parameter of both, which they do not share with anybody
            guard, code = (_without(piece, _EVENT) for piece in (guard, code))
        digits = transition.priority.text.strip()
        return TransitionProgram(
            transition=transition,
            seconds=(delay(transition.trigger) or 0.0) / 1000 if kind == "time" else None,
            event=transition.trigger.text.strip() if kind == "event" else "",
            finished=kind == "finished",
            guard=guard,
            priority=int(digits) if digits.isascii() and digits.isdigit() else None,
            code=code,
        )

    def _inputs(self, bound: frozenset[str], owner: State | None) -> Iterator[InputProgram]:
        first: dict[str, Parameter] = {}
        for item in self._automaton.inputs:
            name, type_name = item.name, item.type.text.strip()
            notes = [Note("the first is here", self._place(first[name]))] if name in first else []
            default: str | None = None
            if not name.isidentifier() or keyword.iskeyword(name) or name in self._reserved | {_EVENT}:
                problem = f"`{name[:60]}` cannot be an input: it becomes a variable of the automaton"
            elif name in first:
                problem = f"a second input is called `{name}`"
            elif name in bound:
                problem = f"the input `{name}` is also given a value by the variables: strike it there"
            elif type_name not in INPUT_TYPES:
                problem = f"the type of the input `{name}` is one of {', '.join(INPUT_TYPES)}"
            else:
                default, problem = _default(item, type_name)
                if not problem and default is None and owner is None:
                    problem = f"the input `{name}` needs a default: nothing owns this automaton"
            if problem:
                self._error(DocumentCode.BAD_INPUT, problem, item.line, item.column, notes)
            first.setdefault(name, item)
            yield InputProgram(name, type_name, default)

    def _arguments(self, state: State, label: str) -> Iterator[ArgumentProgram]:
        given: dict[tuple[int, str], Argument] = {}
        for argument in state.arguments:
            what = f"the argument `{argument.name}` of {label}"
            value = self._read(analyze_expression, what, argument.value)
            child = self._target(state, argument, label)
            key = (child or 0, argument.name)
            if child is None:
                continue
            if key in given:
                note = Note("the first is here", self._place(given[key]))
                message = f"{label} hands over `{argument.name}` twice"
                self._error(DocumentCode.BAD_INPUT, message, argument.line, argument.column, [note])
            given.setdefault(key, argument)
            if value is not None:
                yield ArgumentProgram(child, argument.name, value)
        for child, item in self._inputs_below(state):
            if item.default.is_blank and (child, item.name) not in given:
                note = Note("the input is here", self._place(item))
                message = f"{label} has to hand over `{item.name}` to automaton {child}: it has no default"
                self._error(DocumentCode.BAD_INPUT, message, state.line, state.column, [note])

    def _target(self, state: State, argument: Argument, label: str) -> int | None:
        """Return the automaton that an argument is meant for, or None after an error."""
        named = argument.name
        found = [child for child, item in self._inputs_below(state) if item.name == named]
        if argument.child == NO_CHILD:
            if len(found) == 1:
                return found[0]
            if found:
                ids = " or ".join(f'`child="{child}"`' for child in found)
                message = f"several automata of {label} have an input `{named}`: say {ids}"
            else:
                message = f"no automaton of {label} has an input `{named}`"
        elif argument.child in found:
            return argument.child
        elif argument.child in state.children:
            message = f"automaton {argument.child} has no input `{named}`"
        else:
            message = f"{label} does not own automaton {argument.child}"
        near = did_you_mean(named, [item.name for _, item in self._inputs_below(state)])
        self._error(DocumentCode.BAD_INPUT, message, argument.line, argument.column, near)
        return None

    def _inputs_below(self, state: State) -> Iterator[tuple[int, Parameter]]:
        for child in dict.fromkeys(state.children):
            if child in self._automata:
                yield from ((child, item) for item in self._automata[child].inputs)

    def _block(self, what: str, text: Text) -> Code | None:
        return self._read(analyze_block, what, text)

    def _read(self, analyze: Callable[[Text], _T], what: str, text: Text) -> _T | None:
        return self._reader.read(analyze, what, text, self._path)

    def _place(self, item: Parameter | Argument | Transition) -> Location:
        return Location(item.path or self._path, item.line, max(1, item.column))

    def _error(self, code: str, message: str, line: int, column: int, notes: Sequence[Note] = ()) -> None:
        self._diagnostics.error(code, message, Location(self._path, line, max(1, column)), notes)


def _with_local_names(program: AutomatonProgram) -> AutomatonProgram:
    """Return a program whose pieces bind only names that they share."""
    variables = program.variables
    outside = {item.name for item in program.inputs}
    outside |= (variables.bound | variables.used) if variables else set()
    pieces = list(program.pieces())
    # By the object: two pieces may be equal.
    local = {id(code): names for code, names in zip(pieces, local_names(pieces, outside), strict=True)}

    def shared(code: Code | None) -> Code | None:
        names = local.get(id(code))
        return replace(code, bound=code.bound - names) if code and names else code

    states = (
        replace(state, entry=shared(state.entry), code=shared(state.code), exit=shared(state.exit))
        for state in program.states
    )
    transitions = (
        replace(each, guard=shared(each.guard), code=shared(each.code)) for each in program.transitions
    )
    return replace(program, states=tuple(states), transitions=tuple(transitions))


def _default(item: Parameter, type_name: str) -> tuple[str | None, str]:
    """Return the default of an input as Python, or None without one, and what is wrong with it."""
    if item.default.is_blank:
        return None, ""
    try:
        return literal(parse_value(type_name, item.default)), ""
    except ValueTextError as error:
        return None, f"the default of the input `{item.name}`: {error}"


def _without(piece: Code | None, name: str) -> Code | None:
    return None if piece is None else replace(piece, bound=piece.bound - {name})
