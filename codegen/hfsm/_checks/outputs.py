"""Check the outputs of automata, and the variables into which the states above take them."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping, Sequence
from typing import Final

from ...diagnostics import Note, did_you_mean
from ...messages import NO_MESSAGE, Message
from ..analysis import AutomatonCode, Piece
from ..code._scopes import INSPECTING
from ..code._values import INPUT_TYPES
from ..codes import Code
from ..document import Automaton, Parameter, Result, State
from ..report import Report
from .inputs import named, problem_of, target_of

_KIND_OF_TYPE: Final[Mapping[str, str]] = {"int": "number", "float": "number", "bool": "truth", "str": "text"}
_KINDS: Final[Mapping[type, str]] = {int: "number", float: "number", bool: "truth", str: "text"}
"""Kinds of values: a variable that begins as another one is probably a mistake."""


def check_outputs(code: AutomatonCode, reserved: Collection[str], report: Report) -> None:
    """Check the outputs of an automaton; `reserved` are names that no output may have."""
    bound = code.variables.bound if code.variables is not None else frozenset()
    inputs = {item.name: item for item in code.automaton.inputs}
    first: dict[str, Parameter] = {}
    for item in code.automaton.outputs:
        name = item.name
        problem = problem_of("output", item, reserved, first, bound)
        other = first.get(name) or inputs.get(name)
        if not problem and name in inputs:
            problem = Message("`{name}` is an input already: give the output another name", name=name)
        elif not problem and item.default.is_blank:
            problem = Message(
                "the output `{name}` needs a default: its value until the code assigns it", name=name
            )
        if problem:
            report.error(Code.BAD_OUTPUT, problem, item, [] if other is None else [report.first(other)])
        first.setdefault(name, item)


def check_results(code: AutomatonCode, automata: Mapping[int, Automaton], report: Report) -> None:
    """Check the results of the states of an automaton; `automata` are all, by their ids."""
    for state in code.automaton.states:
        children = [child for child in dict.fromkeys(state.children) if child in automata]
        below = [(child, item) for child in children for item in automata[child].outputs]
        taken: dict[tuple[int, str], Result] = {}
        filled: dict[str, Result] = {}
        for result in state.results:
            found = target_of(state, result, below, automata, report)
            if found is None:
                continue
            child, declared = found
            variable = result.variable.text.strip()
            problem, notes = _variable_problem(code, variable)
            if (child, result.name) in taken:
                problem = Message(
                    "{state} takes the output `{name}` twice", state=named(state), name=result.name
                )
                notes = [report.first(taken[child, result.name])]
            elif not problem and variable in filled:
                problem = Message(
                    "{state} takes two outputs into `{name}`", state=named(state), name=variable
                )
                notes = [report.first(filled[variable])]
            taken.setdefault((child, result.name), result)
            filled.setdefault(variable, result)
            if problem:
                report.error(Code.BAD_RESULT, problem, result, notes)
            else:
                _check_type(code, result, declared, report)


def _variable_problem(code: AutomatonCode, variable: str) -> tuple[Message, Sequence[Note]]:
    """Return what is wrong with the variable of a result, with notes."""
    automaton = code.automaton
    if any(item.name == variable for item in automaton.inputs):
        message = Message(
            "`{name}` is an input, which the state above sets: take the output into another variable",
            name=variable,
        )
        return message, []
    known = code.own_names
    if not variable:
        return Message("the result names no variable"), []
    if variable in known or code.broken:
        return NO_MESSAGE, []
    notes = did_you_mean(variable, known, "variable") or [
        Note(Message("give it an initial value in the variables"))
    ]
    return Message("the automaton has no variable `{name}` for the result", name=variable[:60]), notes


def _check_type(code: AutomatonCode, result: Result, declared: Parameter, report: Report) -> None:
    """Report a variable that is known to be for something else than an output."""
    variable, type_name = result.variable.text.strip(), declared.type.text.strip()
    if type_name not in INPUT_TYPES or type_name == "object":
        return
    note = Note(Message("the output is here"), report.place(declared))
    own = next((item for item in code.automaton.outputs if item.name == variable), None)
    if own is not None:
        wanted = own.type.text.strip()
        if wanted not in (type_name, "object") and (wanted, type_name) != ("float", "int"):
            message = Message(
                "the output `{name}` is {wanted}, and takes `{other}`, which is {type}",
                name=variable,
                wanted=wanted,
                other=result.name,
                type=type_name,
            )
            report.error(Code.BAD_RESULT, message, result, [note])
        return
    first = code.first_value(variable)
    begins = _KINDS.get(type(first.value)) if isinstance(first, ast.Constant) else None
    if begins is not None and begins != _KIND_OF_TYPE[type_name]:
        message = Message(
            "`{name}` begins as `{value}`, and takes the output `{output}`, which is {type}",
            name=variable,
            value=ast.unparse(first)[:40] if first is not None else "",
            output=result.name,
            type=type_name,
        )
        report.warning(Code.RESULT_OF_OTHER_TYPE, message, result, [note])


def check_taken(code: AutomatonCode, report: Report) -> None:
    """Report outputs that no code assigns, and assignments that the next cycle overwrites with an output."""
    if code.broken:
        return
    pieces = list(code.sharing())
    assigned = code.results.union(*(piece.bound for piece in pieces))
    if not any(piece.used & INSPECTING for piece in pieces):
        for item in code.automaton.outputs:
            if item.name not in assigned:
                message = Message(
                    "the output `{name}` is never assigned: it keeps its default", name=item.name
                )
                report.warning(Code.UNSET_OUTPUT, message, item)
    for state in code.automaton.states:
        results = {} if state.final else {each.variable.text.strip(): each for each in state.results}
        for piece in (code.of("entry", state), code.of("code", state)):
            for name in sorted(results.keys() & (frozenset() if piece is None else piece.bound)):
                assert piece is not None
                _report_overwritten(state, results[name], piece, report)


def _report_overwritten(state: State, result: Result, piece: Piece, report: Report) -> None:
    name = result.variable.text.strip()
    place = piece.place_of_store(name)
    if place is not None:
        message = Message(
            "`{name}` is overwritten in the next cycle: {state} takes an output into it",
            name=name,
            state=named(state),
        )
        note = Note(Message("the result is here"), report.place(result))
        report.warning(Code.OVERWRITTEN_RESULT, message, place, [note])
