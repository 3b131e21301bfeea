"""Write down the method of one automaton: its variables, a function for each piece of code, its structure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from ..code.literals import docstring, quoted
from ..code.names import identifier, unique
from ..code.text import INDENT, Code
from ..program import ArgumentProgram, AutomatonProgram, Program, StateProgram, TransitionProgram

__all__ = ["ANNOTATIONS", "AutomatonWriter", "marker", "piece"]

ANNOTATIONS: Final[Mapping[str, str]] = {"Any": "typing", "Mapping": "collections.abc"}
"""Names of the standard library that annotations need, with their modules."""

_LONGEST_LINE: Final = 110
_EVENT: Final = "event: Event"


class AutomatonWriter:
    """Write the method of one automaton; `methods` are the names of those of all automata, by id.

    `needs` are the names that it takes from `hfsm_runtime` and from the standard library.
    """

    def __init__(self, program: Program, automaton: AutomatonProgram, methods: Mapping[int, str]) -> None:
        self._program = program
        self._automaton = automaton
        self._methods = methods
        self._file = automaton.source or program.document_name
        self._taken = _names_in(automaton)
        self._undeclared = _undeclared(automaton)
        self._functions: list[str] = []
        self._set_inputs = self._inputs()
        self._states = [self._state(state) for state in automaton.states]
        self._transitions = [self._transition(transition) for transition in automaton.transitions]

    @property
    def needs(self) -> set[str]:
        """The names that have to be imported for it."""
        automaton = self._automaton
        names = {"Automaton", "State"}
        names |= {"Any"} if self._undeclared else set()
        names |= {"Input", "Mapping"} if automaton.inputs else set()
        names |= {"Transition"} if automaton.transitions else set()
        if any(item.event and (item.guard or item.code) for item in automaton.transitions):
            names.add("Event")
        return names

    def lines(self) -> Iterator[str]:
        """Yield the lines of the method."""
        automaton = self._automaton
        owner = automaton.owner
        role = f"of the state {owner.name!r}" if owner else "of the component"
        source = f", from {automaton.source}" if automaton.source else ""
        yield f"    def {self._methods[automaton.automaton.id]}(self) -> Automaton:"
        yield f'        """Return automaton {automaton.automaton.id}, that {docstring(role + source)}."""'
        for item in automaton.inputs:
            value = "" if item.default is None else f" = {item.default}"
            yield f"        {item.name}: {item.type}{value}  # input"
        if automaton.variables is not None:
            yield from piece(self._file, automaton.variables, 2)
        if self._undeclared:
            yield "        # Shared by the code below, and without a value until some of it assigns one."
            yield from (f"        {name}: Any" for name in self._undeclared)
        yield from self._functions
        yield ""
        yield "        return Automaton("
        yield f"            id={automaton.automaton.id},"
        yield f"            name={quoted(owner.name if owner else self._program.name)},"
        if automaton.source:
            yield f"            source={quoted(automaton.source)},"
        yield f"            period={automaton.period!r},"
        if automaton.inputs:
            yield "            inputs=("
            for item in automaton.inputs:
                default = "" if item.default is None else f", default={item.default}"
                yield f"                Input(name={quoted(item.name)}, type={item.type}{default}),"
            yield "            ),"
            yield f"            set_inputs={self._set_inputs},"
        yield "            states=("
        yield from self._states
        yield "            ),"
        if self._transitions:
            yield "            transitions=("
            yield from self._transitions
            yield "            ),"
        yield "        )"

    def _inputs(self) -> str:
        """Write the function that sets the inputs and return its name; empty without inputs."""
        inputs = self._automaton.inputs
        if not inputs:
            return ""
        function, values = self._unused("set_inputs"), self._unused("values")
        lines = self._functions
        lines += ["", f"        def {function}({values}: Mapping[str, object]) -> None:"]
        lines.append(f"            nonlocal {', '.join(sorted(item.name for item in inputs))}")
        for item in inputs:
            key = quoted(item.name)
            value = f"{values}[{key}]" if item.default is None else f"{values}.get({key}, {item.name})"
            lines.append(f"            {item.name} = {value}")
        return function

    def _state(self, item: StateProgram) -> str:
        state = item.state
        arguments = [f"id={state.id}", f"name={quoted(state.name)}"]
        arguments += ["initial=True"] if item.initial else []
        arguments += ["final=True"] if state.final else []
        for keyword, kind, code in (
            ("entry", "entry", item.entry),
            ("code", "state", item.code),
            ("exit", "exit", item.exit),
        ):
            if code is not None:
                arguments.append(f"{keyword}={self._function(kind, state.name, state.id, code)}")
        if item.children:
            children = "".join(f"self.{self._methods[child]}(), " for child in item.children)
            single = len(item.children) == 1
            arguments.append(f"children=({children.rstrip() if single else children.rstrip(', ')})")
        arguments += ["restart=True"] if item.restart else []
        if item.arguments:
            arguments.append(f"arguments={self._arguments(item)}")
        return _call("State", arguments)

    def _transition(self, item: TransitionProgram) -> str:
        transition = item.transition
        arguments = [f"id={transition.id}", f"name={quoted(transition.name)}"]
        arguments += [f"origin={transition.origin}", f"destination={transition.destination}"]
        arguments += [] if item.priority is None else [f"priority={item.priority}"]
        arguments += [] if item.seconds is None else [f"seconds={item.seconds!r}"]
        arguments += [f"event={quoted(item.event)}"] if item.event else []
        arguments += ["finished=True"] if item.finished else []
        parameter = _EVENT if item.event else ""
        if item.guard is not None:
            text = " ".join(" ".join(item.guard.lines).split())
            function = self._function(
                "guard", transition.name, transition.id, item.guard, parameter, returns="object"
            )
            arguments += [f"guard={function}", f"condition={quoted(text)}"]
        if item.code is not None:
            arguments.append(
                f"code={self._function('fired', transition.name, transition.id, item.code, parameter)}"
            )
        return _call("Transition", arguments)

    def _function(
        self, kind: str, name: str, id: int, code: Code, parameter: str = "", *, returns: str = "None"
    ) -> str:
        """Write a piece of code as a nested function and return the function's name."""
        function = self._unused(f"{kind}_{identifier(name, str(id))}", id)
        lines = self._functions
        lines += ["", f"        def {function}({parameter}) -> {returns}:"]
        if code.bound:
            lines.append(f"            nonlocal {', '.join(sorted(code.bound))}")
        if code.is_expression:
            lines += self._expression("return ", code, 3)
        else:
            lines += piece(self._file, code, 3)
            if not code.has_statements:
                lines.append("            pass")
        return function

    def _arguments(self, item: StateProgram) -> str:
        """Write the function that returns what a state hands to the automata below; return its name."""
        function = self._unused(f"arguments_{identifier(item.state.name, str(item.state.id))}", item.state.id)
        lines = self._functions
        lines += ["", f"        def {function}() -> object:"]
        bound = sorted({name for argument in item.arguments for name in argument.value.bound})
        if bound:
            lines.append(f"            nonlocal {', '.join(bound)}")
        lines.append("            return {")
        by_child: dict[int, list[ArgumentProgram]] = {}
        for argument in item.arguments:
            by_child.setdefault(argument.child, []).append(argument)
        for child, arguments in by_child.items():
            lines.append(f"                {child}: {{")
            for argument in arguments:
                lines += self._expression(f"{quoted(argument.name)}: ", argument.value, 5, end=",")
            lines.append("                },")
        lines.append("            }")
        return function

    def _expression(self, before: str, code: Code, level: int, end: str = "") -> list[str]:
        """Return an expression with what stands around it: on one line, or between parentheses."""
        prefix = INDENT * level
        if len(code.lines) == 1 and "#" not in code.lines[0] and not code.bound:
            return [f"{prefix}{marker(self._file, code)}", f"{prefix}{before}{code.lines[0]}{end}"]
        return [f"{prefix}{before}(", *piece(self._file, code, level + 1), f"{prefix}){end}"]

    def _unused(self, wanted: str, number: int = 1) -> str:
        """Return a name that nothing in the automaton has, and take it."""
        name = unique(wanted, number, self._taken)
        self._taken.add(name)
        return name


def piece(file: str, code: Code, level: int) -> list[str]:
    """Return the lines of a piece of code below a comment that names their file and lines.

    All text of a person that may look like such a comment stands in these lines: who reads the comments from
    the top of the component, and skips the lines that each one names, never takes a person's for one.
    """
    return [INDENT * level + marker(file, code), *code.indented(level)]


def marker(file: str, code: Code) -> str:
    """Return the comment that says where a piece of code comes from."""
    last = code.line + len(code.lines) - 1
    return f"# {file}:{code.line}" if last == code.line else f"# {file}:{code.line}-{last}"


def _call(name: str, arguments: list[str]) -> str:
    """Return an element of a tuple: on one line, or with a line for each argument where that is too long."""
    indent = " " * 16
    line = f"{indent}{name}({', '.join(arguments)}),"
    if len(line) <= _LONGEST_LINE:
        return line
    return "\n".join(
        [f"{indent}{name}(", *(f"{indent}    {argument}," for argument in arguments), f"{indent}),"]
    )


def _names_in(automaton: AutomatonProgram) -> set[str]:
    names = {item.name for item in automaton.inputs}
    pieces: list[Code] = list(automaton.pieces())
    if automaton.variables is not None:
        pieces.append(automaton.variables)
    for code in pieces:
        names |= code.bound | code.used
    return names


def _undeclared(automaton: AutomatonProgram) -> list[str]:
    """Return the names that code assigns and neither the variables nor the inputs do."""
    declared = {item.name for item in automaton.inputs}
    if automaton.variables is not None:
        declared |= automaton.variables.bound
    return sorted({name for code in automaton.pieces() for name in code.bound} - declared)
