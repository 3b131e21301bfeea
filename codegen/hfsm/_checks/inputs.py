"""Check the inputs of automata, and the arguments that states pass to the automata below."""

from __future__ import annotations

import ast
import keyword
from collections.abc import Collection, Mapping

from ...diagnostics import Note, did_you_mean
from ...messages import NO_MESSAGE, Message, any_of
from ..analysis import AutomatonCode
from ..code._values import INPUT_TYPES, ValueTextError, parse_value
from ..codes import Code
from ..document import NO_CHILD, Argument, Automaton, Document, Parameter, State
from .report import Report, state_label

__all__ = ["check_arguments", "check_inputs"]


def check_inputs(document: Document, code: AutomatonCode, reserved: Collection[str], report: Report) -> None:
    """Check the inputs of an automaton; `reserved` are names that no input may have."""
    bound = code.variables.bound if code.variables is not None else frozenset()
    first: dict[str, Parameter] = {}
    for item in code.automaton.inputs:
        name, type_name = item.name, item.type.text.strip()
        notes = [report.first(first[name])] if name in first else []
        problem = NO_MESSAGE
        if not name.isidentifier() or keyword.iskeyword(name) or name in reserved or name == "event":
            problem = Message(
                "`{name}` cannot be an input: it is not a valid name of a variable", name=name[:60]
            )
        elif name in first:
            problem = Message("a second input has the name `{name}`", name=name)
        elif name in bound:
            problem = Message("the input `{name}` is also set by the variables: delete it there", name=name)
        elif type_name not in INPUT_TYPES:
            problem = Message(
                "the type of the input `{name}` must be one of {known}",
                name=name,
                known=", ".join(INPUT_TYPES),
            )
        elif not item.default.is_blank:
            try:
                parse_value(type_name, item.default)
            except ValueTextError as error:
                problem = Message(
                    "the default of the input `{name}`: {error}", name=name, error=error.message
                )
        elif document.owner(code.automaton) is None:
            problem = Message("the input `{name}` needs a default: no state owns this automaton", name=name)
        if problem:
            report.error(Code.BAD_INPUT, problem, item, notes)
        first.setdefault(name, item)


def check_arguments(state: State, automata: Mapping[int, Automaton], report: Report) -> None:
    """Check the arguments of a state for its `automata`, which are given by their ids."""
    children = [child for child in dict.fromkeys(state.children) if child in automata]
    below = [(child, item) for child in children for item in automata[child].inputs]
    given: dict[tuple[int, str], Argument] = {}
    for argument in state.arguments:
        found = _target(state, argument, below, report)
        if found is None:
            continue
        child, declared = found
        if (child, argument.name) in given:
            message = Message("{state} passes `{name}` twice", state=_label(state), name=argument.name)
            first = given[child, argument.name]
            report.error(Code.BAD_INPUT, message, argument, [report.first(first)])
        given.setdefault((child, argument.name), argument)
        _check_literal(argument, declared, report)
    for child, item in below:
        if item.default.is_blank and (child, item.name) not in given:
            message = Message(
                "{state} has to pass `{name}` to automaton {child}: it has no default",
                state=_label(state),
                name=item.name,
                child=child,
            )
            note = Note(Message("the input is here"), report.place(item))
            report.error(Code.BAD_INPUT, message, state, [note])


def _target(
    state: State, argument: Argument, below: list[tuple[int, Parameter]], report: Report
) -> tuple[int, Parameter] | None:
    """Return the automaton and the input of an argument, or None after an error."""
    named, label = argument.name, _label(state)
    found = {child: item for child, item in below if item.name == named}
    if argument.child in found:
        return argument.child, found[argument.child]
    if argument.child != NO_CHILD:
        if argument.child in state.children:
            message = Message("automaton {child} has no input `{name}`", child=argument.child, name=named)
        else:
            message = Message("{state} does not own automaton {child}", state=label, child=argument.child)
    elif len(found) == 1:
        return next(iter(found.items()))
    elif found:
        ids = any_of([f'`child="{child}"`' for child in found])
        message = Message(
            "several automata of {state} have an input `{name}`: write {ids}",
            state=label,
            name=named,
            ids=ids,
        )
    else:
        message = Message("no automaton of {state} has an input `{name}`", state=label, name=named)
    known = did_you_mean(named, [item.name for _, item in below])
    report.error(Code.BAD_INPUT, message, argument, known)
    return None


def _label(state: State) -> Message:
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
