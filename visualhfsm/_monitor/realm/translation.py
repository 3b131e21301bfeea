"""What components and robots say over the network, as messages that a page says in its language.

They are programs that speak English. A text that a template below gives is that message; any other, such as
what a newer program says, stays as it is. The templates are those of `hfsm_runtime` (errors of a component,
its reloads, why a transition does not fire), of `zenoh_ice` (a server that is offline) and those of robots
in `robot_texts.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from msgspec.structs import replace

from codegen.messages import Message, joined, number, template
from codegen.reasons import known_text
from interfaces.hfsm import Explanation
from visualhfsm._monitor.realm.robot_texts import OF_ROBOTS, STANCES

__all__ = ["translate_explanation", "translated"]

_BETWEEN: Final = re.compile(r"(?<=\.) (?=[^\W\d])")
"""Where one sentence follows another."""
_MEMBERS: Final = re.compile(r"(.+) (\(\w+='[^']*'\))", re.DOTALL)
"""The text of an interface's exception, with its other members."""
_REPEATED: Final = re.compile(r"(.+) \((\d+) more since the last report\)", re.DOTALL)
"""An event of a robot that it had more than once."""
_NUMBERS: Final = ("seconds", "value", "lower", "upper", "degrees")
"""Values of templates that are numbers."""

_WHY_NOT: Final = (
    Message("the state is final: no transition is tried"),
    Message("it is forced, and fires in the next cycle"),
    Message("it is not tried before the entry code of the state has run to its end"),
    template("its time comes after {seconds} s more in the state"),
    Message("its time has come: it fires in the next cycle"),
    template("it was not tried: {name}, which comes first, fired"),
    template("the event {event} waits in the queue for the next cycle"),
    template("no event {event} has come since the state was entered"),
    Message("its guard has not been evaluated since the state was entered"),
    Message("the state owns no automaton that could finish: it never fires"),
    Message("all automata of the state have finished: it fires in the next cycle"),
    template("not all automata of the state have finished: {parts}"),
    template("{reason}; now {values}"),
    template("{guard} was true when it was evaluated {seconds} s ago"),
    template("{guard} was false when it was evaluated {seconds} s ago"),
    template("{guard} was true though its time has come, when it was evaluated {seconds} s ago"),
    template("{guard} was false though its time has come, when it was evaluated {seconds} s ago"),
    template("{guard} was true when {event} came {seconds} s ago"),
    template("{guard} was false when {event} came {seconds} s ago"),
)
"""The sentences of `hfsm_runtime/debugger/_explanation.py` about a transition."""
_GUARD: Final = (Message("its guard"), template("its guard `{condition}`"))

_WHERE: Final = (
    Message("The component is paused."),
    template("{automaton} has not run yet: {why}."),
    template("{automaton} is a ghost in {state}: {why}."),
    template("It has been active there for {seconds} s."),
    template("{automaton} has finished in {state}, entered by {transition}."),
    template("{automaton} has finished in {state}."),
    template("{automaton} has been in {state} for {seconds} s, entered by {transition}."),
    template("{automaton} has been in {state} for {seconds} s."),
    Message("No transition leaves the state."),
    template("{automaton} has not completed the entry of {state}"),
    template("{automaton} is in {state}, not in {other}"),
    Message("the component has not started"),
    template("Waiting events: {count} ({events})."),
    template("Events dropped: {count}, the last one ({event}) {seconds} s ago: {why}."),
    Message("no transition out of the current state used it"),
    Message("the automaton became a ghost before its turn"),
    Message("the automaton has finished"),
    template("more than {count} events waited"),
)
"""Its sentences about an automaton."""

_IN_STATE: Final = (template("{automaton} is in {state}"),)

_ERRORS: Final = (
    template(
        "still in a cycle 1 s after {automaton} left the state {state}: its code must not block, and "
        "others drive the robot with it until it ends"
    ),
    template("the event {event} is dropped: more than {count} events waited"),
    template("the condition {condition} has no value: {reason}"),
    template("there is no automaton {id}: there are {others}"),
    template("the component is {status}: pause it first"),
    template(
        "the server of {servant} is offline (connecting to {addresses}); calls continue when it is back"
    ),
    template("the server of {servant} is offline; calls continue when it is back"),
    template("no servant {servant} in realm {realm}; there is {others}"),
    template("no servant {servant} in realm {realm}; the realm has no servants: no robot is here"),
    template("{call} did not answer within {seconds} s"),
    template("{call}: the server restarted during the call"),
    template("{call}: the connection was lost during the call"),
    template("{call}: its servant started during the call, and missed it"),
    template("{call} got no answer, and its process does not answer either"),
    template("{call}: {count} calls are already waiting; this one was not executed"),
    template(
        "{call} was not executed: {servant} exists, but access control does not let this component call "
        "it; `security` in its settings, and in those of the router, says who may"
    ),
    template("no new sample of {stream} within {seconds} s"),
)
"""The sentences of `hfsm_runtime` about an automaton, and of `zenoh_ice` about a server."""

_RELOADS: Final = (
    template("{what}; its exit code did not run"),
    template("automaton {id} ({name}) is gone, which was in {state}"),
    template("automaton {id} ({name}) is gone"),
    template("automaton {id} ({name}) was in the state {state}, which is gone, and restarts in {other}"),
    template("automaton {id} ({name}) has no state {state}"),
    template("automaton {id} ({name}) has no transition {transition}"),
    template("no code of automaton {id} ({name}) uses {names} any more"),
    template("the output {output} of automaton {id} ({name}) is {kind} now and has its default again"),
    template("the parameter {name} is {kind} now and has its default again"),
    template("the parameter {name} is gone"),
    template("self.{name} was an attribute, and is now defined by the document"),
    template("a breakpoint is dropped: {reason}"),
    template("the component cannot be created: {reason}"),
    template(
        "the cycle of {automaton} in the state {state} did not end within {seconds} s: its code must not "
        "block"
    ),
    Message(
        "a component that is recorded is not reloaded, as its recording is of one document: start it again "
        "without --record"
    ),
)
"""Its sentences about a reload: what could not be kept, and why it was refused."""

_SAID: Final = (*_ERRORS, *_RELOADS, *OF_ROBOTS)


def translated(text: str) -> Message:
    """Return a text of a component or a robot as a message."""
    if listed := _MEMBERS.fullmatch(text):
        return joined(" ", [translated(listed[1]), listed[2]])
    if repeated := _REPEATED.fullmatch(text):
        event, count = translated(repeated[1]), repeated[2]
        return Message("{event} ({count} more since the last report)", event=event, count=count)
    found = known_text(text, _SAID)
    for name in ("reason", "what"):
        found = _filled(found, name, translated)
    for name in ("stance", "needed"):
        found = _filled(found, name, lambda stance: known_text(stance, STANCES))
    return _with_number(found)


def translate_explanation(explanation: Explanation) -> Explanation:
    """Return an explanation whose texts are messages."""
    said: list[Message] = []
    rest = explanation.summary
    for each in explanation.transitions:
        before, colon, after = rest.partition(f": {each.reason}.")
        if colon:
            above, number, name = before.rpartition(f"{each.order}. ")
            said += [_where(above.strip()), joined("", [f"{number}{name}: ", _why_not(each.reason), "."])]
            rest = after
    return replace(
        explanation,
        transitions=[replace(each, reason=_why_not(each.reason)) for each in explanation.transitions],
        summary=joined(" ", list(filter(None, [*said, _where(rest.strip())]))),
    )


def _why_not(text: str) -> Message:
    found = _with_number(_filled(known_text(text, _WHY_NOT), "reason", _why_not))
    return _filled(_filled(found, "parts", _in_states), "guard", lambda text: known_text(text, _GUARD))


def _in_states(text: str) -> Message:
    return joined(", ", [known_text(each, _IN_STATE) for each in text.split(", ")])


def _where(text: str) -> Message:
    """Return sentences about an automaton, or a part of one."""
    found = [known_text(sentence, _WHERE) for sentence in _BETWEEN.split(text)]
    return joined(" ", [_with_number(_filled(each, "why", _where)) for each in found])


def _with_number(message: Message) -> Message:
    for name in _NUMBERS:
        message = _filled(message, name, number)
    return message


def _filled(message: Message, name: str, say: Callable[[str], Message]) -> Message:
    """Return a message in which a value that is a sentence is a message, too."""
    value = message.values.get(name)
    return message if value is None else message.again({**message.values, name: say(str(value))})
