"""Write the method of one automaton: its variables, a function for each piece of code, its structure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from ..code_marks import key
from ..python_layout import INDENT, bracketed
from .analysis import AutomatonCode, Part, Piece
from .code._values import delay, milliseconds, parse_value
from .code.names import RESERVED, docstring, identifier, literal, quoted, unique
from .code.text import CodeText
from .document import Automaton, Parameter, State, Transition

_EVENT: Final = "event: Event"
_OURS: Final = RESERVED | {"Event", "Input", "Output", "bool", "float", "int", "object", "str"}
"""Names that the generated method of an automaton may use."""


@dataclass(frozen=True, slots=True)
class CodeLines:
    """Lines of the component with code of the document; `path` is the file that the code comes from.

    `part`, `automaton` and `id` go to its marks, and the `name` of an argument. A block may have them before
    and after it; the single line of other code may end with one.
    """

    lines: Sequence[str]
    code: CodeText
    path: Path
    part: str
    automaton: int = 0
    id: int = 0
    name: str = ""
    is_block: bool = True

    def marked(self) -> tuple[list[str], int]:
        """Return the lines with their marks, and how many of these come before the code."""
        first, *others = self.lines
        if self.part == "library":
            return [first], 0
        mark = key(self.part, self.automaton, self.id, self.name)
        if not self.is_block:
            return [f"{first}  # <{mark}/>", *others], 0
        indent = first[: len(first) - len(first.lstrip())]
        return [f"{indent}# <{mark}>", first, *others, f"{indent}# </{mark}>"], 1


Line = str | CodeLines
"""A generated line of the component, or a piece of code."""


@dataclass(frozen=True, slots=True)
class Method:
    """A method that creates an automaton: the call of it, and the owner of the automaton in words.

    Automata that are imported from one place share a method, which takes the name and the id.
    """

    name: str
    call: str
    role: str
    is_shared: bool = False


class AutomatonWriter:
    """Write the method of one automaton.

    `automata` are all automata of the component by id, and `methods` the methods that create them. `name` is
    that of the automaton. `path` is the file of an imported automaton, and `source` its name in messages.
    `needs` are the names that the method uses from `hfsm_runtime`.
    """

    def __init__(
        self,
        code: AutomatonCode,
        automata: Mapping[int, Automaton],
        methods: Mapping[int, Method],
        *,
        name: str,
        path: Path,
        source: str,
    ) -> None:
        self._code = code
        self._automata = automata
        self._methods = methods
        self._automaton = automaton = code.automaton
        self._path, self._source = path, source
        self._shared = {name for piece in code.by_owner.values() for name in code.shared_names(piece)}
        self._shared |= code.results
        self._taken = {*automaton.declared, *code.results, *_OURS}
        for piece in (*code.by_owner.values(), *([] if code.variables is None else [code.variables])):
            self._taken |= piece.bound | piece.used
        self._method = methods[automaton.id]
        self._name, self._number = quoted(name), str(automaton.id)
        if self._method.is_shared:
            self._name, self._number = self._unused("name"), self._unused("number")
        self._lines: list[Line] = []
        """The functions and the states and transitions that have them, in the order of the document."""
        self._set_inputs = self._unused("set_inputs") if automaton.inputs else ""
        self._set_outputs = self._unused("set_outputs") if automaton.outputs else ""
        self._get_outputs = self._unused("get_outputs") if automaton.outputs else ""
        self._values = self._unused("values")
        # Named by numbers: what a state is called changes no other line.
        self._by_id = {state.id: self._unused(f"state_{state.id}") for state in automaton.states}
        for state in automaton.states:
            arguments = self._state(state)
            self._lines += ["", *bracketed(f"{self._by_id[state.id]} = State(", arguments, ")", INDENT * 2)]
        self._transition_names = [self._transition(item) for item in automaton.transitions]
        self._write_inputs()
        self._write_outputs()

    @property
    def needs(self) -> set[str]:
        """The names that the method needs from `hfsm_runtime`."""
        automaton = self._automaton
        names = {"Automaton", "State"}
        names |= {"Input"} if automaton.inputs else set()
        names |= {"Output"} if automaton.outputs else set()
        names |= {"Transition"} if automaton.transitions else set()
        pieces = self._code.by_owner.values()
        names |= {"Event"} if any(piece.has_event for piece in pieces) else set()
        return names

    def lines(self) -> Iterator[Line]:
        """Yield the method."""
        automaton, variables = self._automaton, self._code.variables
        parameters = "self"
        if self._method.is_shared:
            parameters = f"self, {self._name}: str, {self._number}: int"
        source = f", from {self._source}" if self._source else ""
        yield f"    def {self._method.name}({parameters}) -> Automaton:"
        yield f'        """Return the automaton of {docstring(self._method.role + source)}."""'
        declared = {*automaton.declared}
        for kind, items in (("input", automaton.inputs), ("output", automaton.outputs)):
            for item in items:
                default = _default(item)
                value = "" if default is None else f" = {default}"
                yield f"        {item.name}: {item.type.text.strip()}{value}  # {kind}"
        if variables is not None:
            yield self._code_lines(variables.code.indented(2), ("variables", 0), variables.code)
            declared |= variables.bound
        if self._shared - declared:
            yield "        # Shared by the code below; they have no value until some of it assigns one."
            yield from (f"        {name}: object" for name in sorted(self._shared - declared))
        yield from self._lines
        yield ""
        yield "        return Automaton("
        yield f"            {self._name},"
        yield f"            id={self._number},"
        if self._source:
            line = f"            source={quoted(self._source)},"
            yield self._code_line(line, ("automaton", 0), CodeText((line,), automaton.line))
        yield f"            period={(milliseconds(automaton.iteration_time) or 0.0) / 1000!r},"
        if automaton.inputs:
            yield "            inputs=("
            for item in automaton.inputs:
                default = "" if item.default.is_blank else f", default={_default(item)}"
                type_name = item.type.text.strip()
                yield f"                Input(name={quoted(item.name)}, type={type_name}{default}),"
            yield "            ),"
            yield f"            set_inputs={self._set_inputs},"
        if automaton.outputs:
            yield "            outputs=("
            for item in automaton.outputs:
                kind, default = item.type.text.strip(), _default(item)
                yield f"                Output(name={quoted(item.name)}, type={kind}, default={default}),"
            yield "            ),"
            yield f"            set_outputs={self._set_outputs},"
            yield f"            get_outputs={self._get_outputs},"
        yield from _tuple("states", [*self._by_id.values()])
        if automaton.transitions:
            yield from _tuple("transitions", self._transition_names)
        yield "        )"

    def _write_inputs(self) -> None:
        """Write the function that sets the inputs, if there are some, after the code of the document."""
        inputs = self._automaton.inputs
        if not inputs:
            return
        values, lines = self._values, self._lines
        lines += ["", f"        def {self._set_inputs}({values}):"]
        lines.append(f"            nonlocal {', '.join(sorted(item.name for item in inputs))}")
        for item in inputs:
            key = quoted(item.name)
            value = f"{values}[{key}]" if item.default.is_blank else f"{values}.get({key}, {item.name})"
            lines.append(f"            {item.name} = {value}")

    def _write_outputs(self) -> None:
        """Write the functions that set and return the outputs, if there are some."""
        names = [item.name for item in self._automaton.outputs]
        if not names:
            return
        values, lines = self._values, self._lines
        lines += ["", f"        def {self._set_outputs}({values}):"]
        lines.append(f"            nonlocal {', '.join(sorted(names))}")
        lines += [f"            {name} = {values}[{quoted(name)}]" for name in names]
        lines += ["", f"        def {self._get_outputs}():", "            return {"]
        lines += [f"                {quoted(name)}: {name}," for name in names]
        lines.append("            }")

    def _state(self, state: State) -> list[str]:
        """Write the code of a state as functions; return the arguments of its constructor."""
        arguments = [quoted(state.name), f"id={state.id}"]
        states = self._automaton.states
        initial = next((each for each in states if each.initial), states[0])
        arguments += ["initial=True"] if state is initial else []
        arguments += ["final=True"] if state.final else []
        parts: tuple[tuple[Part, str], ...] = (("entry", "entry"), ("code", "state"), ("exit", "exit"))
        for part, kind in parts:
            if (piece := self._code.of(part, state)) is not None:
                arguments.append(f"{part}={self._function(kind, part, state, piece)}")
        calls = [f"self.{self._methods[child].call}" for child in state.children if child in self._automata]
        if calls:
            arguments.append(f"children=({', '.join(calls)}{',' if len(calls) == 1 else ''})")
        arguments += ["restart=True"] if state.history.text.strip() == "restart" else []
        if state.arguments:
            arguments.append(f"arguments={self._arguments(state)}")
        if state.results and not state.final:
            arguments.append(f"results={self._results(state)}")
        return arguments

    def _transition_code(self, transition: Transition) -> list[str]:
        """Write the guard and code of a transition as functions; return the arguments for them."""
        guard, code = self._code.of("guard", transition), self._code.of("fired", transition)
        parameter = _EVENT if transition.type == "event" else ""
        arguments = []
        if transition.type == "condition":
            # With the original generator, too, an empty condition never holds.
            guard_or_never = guard or CodeText(("False",), transition.trigger.line)
            function = self._function("guard", "trigger", transition, guard_or_never)
            arguments.append(f"guard={function}")
        elif guard is not None:
            arguments.append(f"guard={self._function('guard', 'guard', transition, guard, parameter)}")
        if code is not None:
            arguments.append(f"code={self._function('fired', 'fired', transition, code, parameter)}")
        return arguments

    def _transition(self, transition: Transition) -> str:
        """Write a transition, after its guard and code as functions; return its name in the method."""
        name = self._unused(f"transition_{transition.id}")
        trigger, priority = transition.trigger, transition.priority.text.strip()
        arguments = [quoted(transition.name)]
        arguments += [self._by_id[transition.origin], self._by_id[transition.destination]]
        arguments.append(f"id={transition.id}")
        arguments += [f"priority={int(priority)}"] if priority else []
        match transition.type:
            case "time":
                arguments.append(f"seconds={(delay(trigger) or 0.0) / 1000!r}")
            case "event":
                arguments.append(f"event={quoted(trigger.text.strip())}")
            case "finished":
                arguments.append("finished=True")
        arguments += self._transition_code(transition)
        self._lines += ["", *bracketed(f"{name} = Transition(", arguments, ")", INDENT * 2)]
        return name

    def _function(
        self, kind: str, part: str, owner: State | Transition, written: Piece | CodeText, parameter: str = ""
    ) -> str:
        """Write a piece of code, or a generated expression, as a nested function; return its name."""
        function = self._unused(f"{kind}_{identifier(owner.name, str(owner.id))}", owner.id)
        lines = self._lines
        lines += ["", f"        def {function}({parameter}):"]
        if isinstance(written, CodeText):
            lines.append(self._code_line(f"            return {written.lines[0]}", (part, owner.id), written))
            return function
        lines += self._nonlocal(written)
        if written.is_expression:
            lines += self._expression("            return ", (part, owner.id), written)
        else:
            lines.append(self._code_lines(written.code.indented(3), (part, owner.id), written.code))
            lines += [] if written.tree.body else ["            pass"]
        return function

    def _nonlocal(self, *pieces: Piece) -> list[str]:
        names = {name for piece in pieces for name in self._code.shared_names(piece)}
        return [f"            nonlocal {', '.join(sorted(names))}"] if names else []

    def _arguments(self, state: State) -> str:
        """Write the function that returns the arguments for the automata below a state; return its name."""
        function = self._unused(f"arguments_{identifier(state.name, str(state.id))}", state.id)
        children = [child for child in state.children if child in self._automata]
        by_child: dict[int, list[tuple[str, Piece]]] = {}
        pieces = []
        for argument in state.arguments:
            piece = self._code.of("argument", argument)
            assert piece is not None, "an empty value is an error"
            pieces.append(piece)
            takers = (
                child
                for child in children
                if any(item.name == argument.name for item in self._automata[child].inputs)
            )
            child = argument.child or next(takers)
            by_child.setdefault(child, []).append((argument.name, piece))
        lines = self._lines
        lines += ["", f"        def {function}():", *self._nonlocal(*pieces)]
        lines.append("            return {")
        only = len(children) == 1
        for child, arguments in by_child.items():
            lines += [] if only else [f"                {child}: {{"]
            for name, piece in arguments:
                before = f"{INDENT * (4 if only else 5)}{quoted(name)}: "
                lines += self._expression(before, ("argument", state.id), piece, ",", name)
            lines += [] if only else ["                },"]
        lines.append("            }")
        return function

    def _results(self, state: State) -> str:
        """Write the function that takes outputs of the automata below a state; return its name."""
        function = self._unused(f"results_{identifier(state.name, str(state.id))}", state.id)
        values = self._values
        children = [child for child in state.children if child in self._automata]
        variables = {result.variable.text.strip() for result in state.results}
        lines = self._lines
        lines += ["", f"        def {function}({values}):"]
        lines.append(f"            nonlocal {', '.join(sorted(variables))}")
        for result in state.results:
            givers = (child for child in children if result.name in _outputs_of(self._automata[child]))
            child = result.child or next(givers)
            of_child = values if len(children) == 1 else f"{values}[{child}]"
            lines.append(f"            {result.variable.text.strip()} = {of_child}[{quoted(result.name)}]")
        return function

    def _expression(
        self, before: str, what: tuple[str, int], piece: Piece, end: str = "", name: str = ""
    ) -> list[Line]:
        """Return an expression between two texts: on one line, or in parentheses."""
        code = piece.code
        if len(code.lines) == 1 and "#" not in code.lines[0] and not piece.bound:
            return [self._code_line(f"{before}{code.lines[0]}{end}", what, code, name)]
        indent = before[: len(before) - len(before.lstrip())]
        lines = self._code_lines(code.indented(len(indent) // len(INDENT) + 1), what, code, name)
        return [f"{before}(", lines, f"{indent}){end}"]

    def _code_line(self, line: str, what: tuple[str, int], code: CodeText, name: str = "") -> CodeLines:
        """Return a line with code that is all its statement."""
        return replace(self._code_lines([line], what, code, name), is_block=False)

    def _code_lines(
        self, lines: Sequence[str], what: tuple[str, int], code: CodeText, name: str = ""
    ) -> CodeLines:
        """Return lines with code; `what` has its part, and the id of the state or the transition."""
        return CodeLines(lines, code, self._path, what[0], self._automaton.id, what[1], name)

    def _unused(self, wanted: str, number: int = 1) -> str:
        """Return a name that is unused in the automaton, and reserve it."""
        name = unique(wanted, number, self._taken)
        self._taken.add(name)
        return name


def _tuple(name: str, items: Sequence[str]) -> list[str]:
    """Return a keyword argument whose value is a tuple of names, each on a line: changes of two merge."""
    return [f"            {name}=(", *(f"                {item}," for item in items), "            ),"]


def _outputs_of(automaton: Automaton) -> set[str]:
    return {item.name for item in automaton.outputs}


def _default(item: Parameter) -> str | None:
    """Return the default of an input or an output as Python, or None if it has none."""
    return None if item.default.is_blank else literal(parse_value(item.type.text.strip(), item.default))
