"""Check the inputs of automata, and the arguments that states pass to the automata below."""

from __future__ import annotations

import ast
from collections.abc import Collection, Mapping
from typing import Literal

from ...diagnostics import Note, did_you_mean
from ...messages import NO_MESSAGE, Message, Value, any_of
from ..analysis import AutomatonCode
from ..code._values import INPUT_TYPES, ValueTextError, parse_value
from ..code.names import is_name
from ..codes import Code
from ..document import NO_CHILD, Argument, Automaton, Document, Parameter, Result, State
from ..report import Report, state_label


def check_inputs(document: Document, code: AutomatonCode, reserved: Collection[str], report: Report) -> None:
    """Check the inputs of an automaton; `reserved` are names that no input may have."""
    bound = code.variables.bound if code.variables is not None else frozenset()
    first: dict[str, Parameter] = {}
    for item in code.automaton.inputs:
        name = item.name
        notes = [report.first(first[name])] if name in first else []
        problem = problem_of("input", item, reserved, first, bound)
        if not problem and item.default.is_blank and document.owner(code.automaton) is None:
            problem = Message("the input `{name}` needs a default: no state owns this automaton", name=name)
        if problem:
            report.error(Code.BAD_INPUT, problem, item, notes)
        first.setdefault(name, item)


def problem_of(
    kind: Literal["input", "output"],
    item: Parameter,
    reserved: Collection[str],
    others: Collection[str],
    bound: Collection[str],
) -> Message:
    """Return what is wrong with the declaration of an input or an output; empty if nothing is.

    No name may be `reserved`, that of `others` before it, or `bound` by the variables.
    """
    name, type_name, is_input = item.name, item.type.text.strip(), kind == "input"
    if not is_name(name) or name in reserved or name == "event":
        if is_input:
            return Message(
                "`{name}` cannot be an input: it is not a valid name of a variable", name=name[:60]
            )
        return Message("`{name}` cannot be an output: it is not a valid name of a variable", name=name[:60])
    if name in others:
        if is_input:
            return Message("a second input has the name `{name}`", name=name)
        return Message("a second output has the name `{name}`", name=name)
    if name in bound:
        if is_input:
            return Message("the input `{name}` is also set by the variables: delete it there", name=name)
        return Message("the output `{name}` is also set by the variables: delete it there", name=name)
    if type_name not in INPUT_TYPES:
        known = ", ".join(INPUT_TYPES)
        if is_input:
            return Message("the type of the input `{name}` must be one of {known}", name=name, known=known)
        return Message("the type of the output `{name}` must be one of {known}", name=name, known=known)
    if not item.default.is_blank:
        try:
            parse_value(type_name, item.default)
        except ValueTextError as error:
            if is_input:
                return Message("the default of the input `{name}`: {error}", name=name, error=error.message)
            return Message("the default of the output `{name}`: {error}", name=name, error=error.message)
    return NO_MESSAGE


def check_arguments(state: State, automata: Mapping[int, Automaton], report: Report) -> None:
    """Check the arguments of a state for its `automata`, which are given by their ids."""
    children = [child for child in dict.fromkeys(state.children) if child in automata]
    below = [(child, item) for child in children for item in automata[child].inputs]
    given: dict[tuple[int, str], Argument] = {}
    for argument in state.arguments:
        found = target_of(state, argument, below, automata, report)
        if found is None:
            continue
        child, declared = found
        if (child, argument.name) in given:
            message = Message("{state} passes `{name}` twice", state=named(state), name=argument.name)
            first = given[child, argument.name]
            report.error(Code.BAD_INPUT, message, argument, [report.first(first)])
        given.setdefault((child, argument.name), argument)
        _check_literal(argument, declared, report)
    for child, item in below:
        if item.default.is_blank and (child, item.name) not in given:
            values: dict[str, Value] = {"state": named(state), "name": item.name, "child": child}
            message = Message("{state} has to pass `{name}` to its automaton: it has no default", **values)
            if len(children) > 1:
                message = Message(
                    "{state} has to pass `{name}` to automaton {child}: it has no default", **values
                )
            note = Note(Message("the input is here"), report.place(item))
            report.error(Code.BAD_INPUT, message, state, [note])


def target_of(
    state: State,
    argument: Argument | Result,
    below: list[tuple[int, Parameter]],
    automata: Mapping[int, Automaton],
    report: Report,
) -> tuple[int, Parameter] | None:
    """Return the automaton and the input of an argument, or the output of a result.

    Returns None after an error, and where the automaton could not be imported.
    """
    name, label = argument.name, named(state)
    is_input = isinstance(argument, Argument)
    code = Code.BAD_INPUT if is_input else Code.BAD_RESULT
    found = {child: item for child, item in below if item.name == name}
    if argument.child in found:
        return argument.child, found[argument.child]
    meant = state.children if argument.child == NO_CHILD else [argument.child]
    if not found and any(child in automata and automata[child].imported for child in meant):
        return None
    if argument.child != NO_CHILD:
        if argument.child in state.children:
            message = (
                Message("automaton {child} has no input `{name}`", child=argument.child, name=name)
                if is_input
                else Message("automaton {child} has no output `{name}`", child=argument.child, name=name)
            )
        else:
            message = Message("{state} does not own automaton {child}", state=label, child=argument.child)
    elif len(found) == 1:
        return next(iter(found.items()))
    elif found:
        ids = any_of([f'`child="{child}"`' for child in found])
        values: dict[str, Value] = {"state": label, "name": name, "ids": ids}
        message = (
            Message("several automata of {state} have an input `{name}`: write {ids}", **values)
            if is_input
            else Message("several automata of {state} have an output `{name}`: write {ids}", **values)
        )
    elif is_input:
        message = Message("no automaton of {state} has an input `{name}`", state=label, name=name)
    else:
        message = Message("no automaton of {state} has an output `{name}`", state=label, name=name)
    known = did_you_mean(name, [item.name for _, item in below], "name")
    report.error(code, message, argument, known)
    return None


def named(state: State) -> Message:
    """Return a state in messages, such as state `go`."""
    label = state_label(state)
    return Message("state {label}", label=label) if state.name.strip() else label


def _check_literal(argument: Argument, declared: Parameter, report: Report) -> None:
    """Check that a literal has the type of its input; other values are checked at run time."""
    type_name = declared.type.text.strip()
    if type_name not in INPUT_TYPES:
        return
    try:
        ast.literal_eval(argument.value.text.strip())
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        return  # an expression
    try:
        parse_value(type_name, argument.value)
    except ValueTextError as error:
        message = Message(
            "the input `{name}` gets a wrong value: {error}", name=declared.name, error=error.message
        )
        note = Note(Message("the input is here"), report.place(declared))
        report.error(Code.BAD_ARGUMENT, message, report.place(argument, argument.value), [note])
