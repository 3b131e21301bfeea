"""Write the method of one automaton: its variables, a function for each piece of code, its structure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ..code.literals import docstring, quoted
from ..code.names import RESERVED, identifier, unique
from ..code.text import INDENT, Code
from ..document import State, Transition
from ..program import ArgumentProgram, AutomatonProgram, Program, StateProgram, TransitionProgram

__all__ = ["AutomatonWriter", "Line", "Piece"]

_LONGEST_LINE: Final = 110
_EVENT: Final = "event: Event"
_OURS: Final = RESERVED | {"Event", "Input", "bool", "float", "int", "object", "str"}
"""Names that the method of an automaton may use itself."""


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of code with the lines in which it stands in the component, and what the source map says of it.

    `path` is the file in which it was written and `file` the name of that.
    """

    lines: Sequence[str]
    code: Code
    path: Path | None
    file: str
    part: str
    automaton: int = 0
    id: int = 0


Line = str | Piece
"""A line of the component that the generator writes, or a piece of code."""


class AutomatonWriter:
    """Write the method of one automaton; `methods` are the names of those of all automata, by id.

    `needs` are the names that it takes from `hfsm_runtime`.
    """

    def __init__(self, program: Program, automaton: AutomatonProgram, methods: Mapping[int, str]) -> None:
        self._program = program
        self._automaton = automaton
        self._methods = methods
        self._file = automaton.source or program.document_name
        self._taken = _names_in(automaton) | _OURS
        self._undeclared = _undeclared(automaton)
        self._functions: list[Line] = []
        self._set_inputs = self._inputs()
        states = [self._state(state) for state in automaton.states]
        self._transition_functions = [self._transition_code(item) for item in automaton.transitions]
        self._names = [
            self._unused(identifier(item.state.name, f"state_{item.state.id}"), item.state.id)
            for item in automaton.states
        ]
        self._by_id = {item.state.id: name for item, name in zip(automaton.states, self._names, strict=True)}
        self._states = [
            line
            for name, arguments in zip(self._names, states, strict=True)
            for line in _call(f"{name} = State", arguments, 2)
        ]

    @property
    def needs(self) -> set[str]:
        """The names that have to be imported for it."""
        automaton = self._automaton
        names = {"Automaton", "State"}
        names |= {"Input"} if automaton.inputs else set()
        names |= {"Transition"} if automaton.transitions else set()
        if any(item.event and (item.guard or item.code) for item in automaton.transitions):
            names.add("Event")
        return names

    def lines(self) -> Iterator[Line]:
        """Yield the method."""
        automaton = self._automaton
        owner = automaton.owner
        role = f"the state {owner.name!r}" if owner else "the component"
        source = f", from {automaton.source}" if automaton.source else ""
        yield f"    def {self._methods[automaton.automaton.id]}(self) -> Automaton:"
        yield f'        """Return the automaton of {docstring(role + source)}."""'
        for item in automaton.inputs:
            value = "" if item.default is None else f" = {item.default}"
            yield f"        {item.name}: {item.type}{value}  # input"
        if automaton.variables is not None:
            yield self._piece(automaton.variables.indented(2), ("variables", 0), automaton.variables)
        if self._undeclared:
            yield "        # Shared by the code below, and without a value until some of it assigns one."
            yield from (f"        {name}: object" for name in self._undeclared)
        yield from self._functions
        yield ""
        yield from self._states
        yield "        return Automaton("
        yield f"            {quoted(owner.name if owner else self._program.name)},"
        yield f"            id={automaton.automaton.id},"
        if automaton.source:
            line = f"            source={quoted(automaton.source)},"
            yield self._piece([line], ("automaton", 0), Code((line,), automaton.automaton.line))
        yield f"            period={automaton.period!r},"
        if automaton.inputs:
            yield "            inputs=("
            for item in automaton.inputs:
                default = "" if item.default is None else f", default={item.default}"
                yield f"                Input(name={quoted(item.name)}, type={item.type}{default}),"
            yield "            ),"
            yield f"            set_inputs={self._set_inputs},"
        yield from _tuple("states", self._names)
        if automaton.transitions:
            yield "            transitions=("
            for index, transition in enumerate(automaton.transitions):
                yield from _call("Transition", self._transition(index, transition), 4, end=",")
            yield "            ),"
        yield "        )"

    def _inputs(self) -> str:
        """Write the function that sets the inputs and return its name; empty without inputs."""
        inputs = self._automaton.inputs
        if not inputs:
            return ""
        function, values = self._unused("set_inputs"), self._unused("values")
        lines = self._functions
        lines += ["", f"        def {function}({values}):"]
        lines.append(f"            nonlocal {', '.join(sorted(item.name for item in inputs))}")
        for item in inputs:
            key = quoted(item.name)
            value = f"{values}[{key}]" if item.default is None else f"{values}.get({key}, {item.name})"
            lines.append(f"            {item.name} = {value}")
        return function

    def _state(self, item: StateProgram) -> list[str]:
        """Write the code of a state as functions; return what its constructor takes."""
        state = item.state
        arguments = [quoted(state.name)]
        if state.id != self._automaton.states.index(item) + 1:
            arguments.append(f"id={state.id}")
        arguments += ["initial=True"] if item.initial else []
        arguments += ["final=True"] if state.final else []
        for part, kind, code in (
            ("entry", "entry", item.entry),
            ("code", "state", item.code),
            ("exit", "exit", item.exit),
        ):
            if code is not None:
                arguments.append(f"{part}={self._function(kind, part, state, code)}")
        if item.children:
            children = [f"self.{self._methods[child]}()" for child in item.children]
            arguments.append(f"children=({', '.join(children)}{',' if len(children) == 1 else ''})")
        arguments += ["restart=True"] if item.restart else []
        if item.arguments:
            arguments.append(f"arguments={self._arguments(item)}")
        return arguments

    def _transition_code(self, item: TransitionProgram) -> list[str]:
        """Write guard and code of a transition as functions; return what its constructor takes for them."""
        transition = item.transition
        parameter = _EVENT if item.event else ""
        part = "trigger" if transition.type == "condition" else "guard"
        pieces = (("guard", part, "guard", item.guard), ("fired", "fired", "code", item.code))
        return [
            f"{argument}={self._function(kind, part, transition, code, parameter)}"
            for kind, part, argument, code in pieces
            if code is not None
        ]

    def _transition(self, index: int, item: TransitionProgram) -> list[str]:
        """Return what the constructor of a transition takes."""
        transition = item.transition
        arguments = [quoted(transition.name)]
        arguments += [self._by_id[transition.origin], self._by_id[transition.destination]]
        arguments += [] if transition.id == index + 1 else [f"id={transition.id}"]
        arguments += [] if item.priority is None else [f"priority={item.priority}"]
        arguments += [] if item.seconds is None else [f"seconds={item.seconds!r}"]
        arguments += [f"event={quoted(item.event)}"] if item.event else []
        arguments += ["finished=True"] if item.finished else []
        return arguments + self._transition_functions[index]

    def _function(
        self, kind: str, part: str, owner: State | Transition, code: Code, parameter: str = ""
    ) -> str:
        """Write a piece of code as a nested function and return the function's name."""
        function = self._unused(f"{kind}_{identifier(owner.name, str(owner.id))}", owner.id)
        lines = self._functions
        lines += ["", f"        def {function}({parameter}):"]
        if code.bound:
            lines.append(f"            nonlocal {', '.join(sorted(code.bound))}")
        if code.is_expression:
            lines += self._expression("            return ", (part, owner.id), code)
        else:
            lines.append(self._piece(code.indented(3), (part, owner.id), code))
            if not code.has_statements:
                lines.append("            pass")
        return function

    def _arguments(self, item: StateProgram) -> str:
        """Write the function that returns what a state hands to the automata below; return its name."""
        function = self._unused(f"arguments_{identifier(item.state.name, str(item.state.id))}", item.state.id)
        lines = self._functions
        lines += ["", f"        def {function}():"]
        bound = sorted({name for argument in item.arguments for name in argument.value.bound})
        if bound:
            lines.append(f"            nonlocal {', '.join(bound)}")
        lines.append("            return {")
        by_child: dict[int, list[ArgumentProgram]] = {}
        for argument in item.arguments:
            by_child.setdefault(argument.child, []).append(argument)
        only = len(item.children) == 1
        for child, arguments in by_child.items():
            lines += [] if only else [f"                {child}: {{"]
            for argument in arguments:
                before = f"{INDENT * (4 if only else 5)}{quoted(argument.name)}: "
                lines += self._expression(before, ("argument", item.state.id), argument.value, ",")
            lines += [] if only else ["                },"]
        lines.append("            }")
        return function

    def _expression(self, before: str, what: tuple[str, int], code: Code, end: str = "") -> list[Line]:
        """Return an expression with what stands around it: on one line, or between parentheses."""
        if len(code.lines) == 1 and "#" not in code.lines[0] and not code.bound:
            return [self._piece([f"{before}{code.lines[0]}{end}"], what, code)]
        indent = before[: len(before) - len(before.lstrip())]
        piece = self._piece(code.indented(len(indent) // len(INDENT) + 1), what, code)
        return [f"{before}(", piece, f"{indent}){end}"]

    def _piece(self, lines: Sequence[str], what: tuple[str, int], code: Code) -> Piece:
        """Return a piece of code; `what` it is are its part, and the id of the state or the transition."""
        automaton = self._automaton.automaton
        return Piece(lines, code, automaton.path, self._file, what[0], automaton.id, what[1])

    def _unused(self, wanted: str, number: int = 1) -> str:
        """Return a name that nothing in the automaton has, and take it."""
        name = unique(wanted, number, self._taken)
        self._taken.add(name)
        return name


def _call(name: str, arguments: Sequence[str], level: int, end: str = "") -> list[str]:
    """Return a call: on one line, or with a line for each argument where that is too long."""
    indent = INDENT * level
    line = f"{indent}{name}({', '.join(arguments)}){end}"
    if len(line) <= _LONGEST_LINE:
        return [line]
    return [f"{indent}{name}(", *(f"{indent}    {argument}," for argument in arguments), f"{indent}){end}"]


def _tuple(name: str, items: Sequence[str]) -> list[str]:
    """Return an argument that is a tuple of names."""
    line = f"            {name}=({', '.join(items)}{',' if len(items) == 1 else ''}),"
    if len(line) <= _LONGEST_LINE:
        return [line]
    return [f"            {name}=(", *(f"                {item}," for item in items), "            ),"]


def _names_in(automaton: AutomatonProgram) -> set[str]:
    names = {item.name for item in automaton.inputs}
    pieces: list[Code] = list(automaton.pieces())
    if automaton.variables is not None:
        pieces.append(automaton.variables)
    for code in pieces:
        names |= code.bound | code.used
    return names


def _undeclared(automaton: AutomatonProgram) -> list[str]:
    """Return the names that code shares and neither the variables nor the inputs declare."""
    declared = {item.name for item in automaton.inputs}
    if automaton.variables is not None:
        declared |= automaton.variables.bound
    return sorted({name for code in automaton.pieces() for name in code.bound} - declared)
