"""Read SCXML into the model of a document.

A file that was written here gives the document that it was. Of any other what can be said here is carried,
and the rest is told.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Final

from codegen.diagnostics import Diagnostics

from ..document import Automaton, Comment, Document, State, Text, Transition
from ..formats.dialects.native import NativeReader
from ..formats.xml_tree import XmlElement, parse_xml, read_bytes
from .assembly import Assembly
from .chart import Chart, ChartAutomaton
from .code import CodeReader
from .problems import Problems
from .qualified import QualifiedTree, local_name
from .routes import Routes
from .timers import Timers
from .vocabulary import SCXML_NAMESPACE

__all__ = ["is_scxml", "parse_scxml", "read_scxml"]

_ROOT: Final = "scxml"
_START: Final = re.compile(
    rb"\A(?:\xef\xbb\xbf)?(?:\s|<\?.*?\?>|<!--.*?-->)*<(?:[\w.-]+:)?scxml[\s/>]", re.DOTALL
)
_STATE_PARTS: Final = frozenset(
    ("onentry", "onexit", "transition", "initial", "state", "parallel", "final", "history", "datamodel")
)
_PARTS: Final = {
    _ROOT: frozenset(("state", "parallel", "final", "datamodel", "script", "initial")),
    "state": _STATE_PARTS,
    "parallel": _STATE_PARTS,
    "final": frozenset(("onentry", "onexit", "transition")),
}


def is_scxml(head: bytes) -> bool:
    """Return whether a file that begins so has the root of SCXML."""
    return _START.match(head) is not None


def read_scxml(path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None) -> Document | None:
    """Return the document in a file of SCXML, or None after errors were reported.

    `remarks` gets notes about what is kept without being used.
    """
    content = read_bytes(path, diagnostics)
    return None if content is None else parse_scxml(content, path, diagnostics, remarks)


def parse_scxml(
    content: bytes | str, path: Path, diagnostics: Diagnostics, remarks: Diagnostics | None = None
) -> Document | None:
    """Return the document in SCXML, or None after errors were reported; `path` is for the messages."""
    if isinstance(content, str):
        content = content.encode()
    parsed = parse_xml(content, path, diagnostics)
    if parsed is None:
        return None
    root, comments = parsed
    problems = Problems(path, diagnostics)
    tree = QualifiedTree(root)
    if tree.scxml(root) != _ROOT:
        message = f"`{root.tag[:60]}` is not the root of SCXML: it is `{_ROOT}`, of {SCXML_NAMESPACE}"
        problems.invalid(root, message)
        return None
    document = _ScxmlReader(root, tree, problems).document(NativeReader(path, diagnostics, remarks))
    if document is None:
        return None
    return replace(document, comments=tuple(Comment(text) for text in comments))


class _ScxmlReader:
    def __init__(self, root: XmlElement, tree: QualifiedTree, problems: Problems) -> None:
        self._tree = tree
        self._problems = problems
        self._chart = Chart(root, tree, problems)
        self._code = CodeReader(root.attributes.get("datamodel", ""), tree, problems)
        self._root = root

    def document(self, native: NativeReader) -> Document | None:
        """Return the document, or None when it could not be made; `native` reads what it is made of."""
        if self._says_its_language():
            self._code.keep()
        timers = Timers(self._chart, self._problems)
        routes = Routes(self._chart, self._code, timers, self._problems)
        routes.trace()
        assembly = Assembly(self._chart, self._code, timers, self._problems)
        self._tell_of_rest()
        sent = {
            self._code.event(element.attributes.get("event", ""))
            for element in self._tree.everywhere(self._root, "raise", "send")
        }
        events = dict.fromkeys(name for name in routes.events if name not in sent)
        document = native.document(assembly.document(list(events)))
        if native.failed or self._problems.failed:
            return None
        native.tell_remarks()
        document = replace(document, automata=tuple(map(self._in_order, document.automata)))
        if not self._tree.has_own:
            self._check_scopes(document, assembly)
        return document

    def _says_its_language(self) -> bool:
        own = self._tree.own_inside(self._root, "VisualHFSM") or self._tree.own_inside(
            self._root, "VisualStates"
        )
        return own is not None and any(
            self._tree.own(child) == "language" and child.text.strip() for child in own.elements()
        )

    def _in_order(self, automaton: Automaton) -> Automaton:
        """Return an automaton whose transitions are tried in the order of SCXML."""
        chart = next((each for each in self._chart.automata if each.number == automaton.id), None)
        if chart is None or automaton.father != _father(chart):
            return automaton
        changed: dict[int, Transition] = {}
        places = {id(each): place for place, each in enumerate(automaton.transitions)}
        for state in chart.states:
            wanted = [int(edge.native.attributes["id"]) for edge in state.edges if edge.native is not None]
            outgoing = automaton.outgoing(state.number)
            found = [each.id for each in outgoing if each.id in wanted]
            if found != wanted and len(set(wanted)) == len(wanted):
                by_id = {each.id: each for each in outgoing}
                for priority, number in enumerate(wanted, 1):
                    each = by_id[number]
                    changed[places[id(each)]] = replace(each, priority=Text(str(priority)))
        return replace(
            automaton,
            transitions=tuple(changed.get(place, each) for place, each in enumerate(automaton.transitions)),
        )

    def _tell_of_rest(self) -> None:
        """Tell of elements that nothing here is made of."""
        others: set[str] = set()
        elements = [self._root]
        while elements:
            element = elements.pop()
            known = _PARTS.get(self._tree.scxml(element))
            for child in element.elements():
                name = self._tree.scxml(child)
                if self._tree.is_other(child):
                    if local_name(child.tag) not in others:
                        message = f"`{child.tag[:60]}` belongs to another program and is not carried"
                        self._problems.of_others(child, message)
                    others.add(local_name(child.tag))
                elif name and known is not None and name not in known:
                    self._problems.lost(child, f"`{name[:60]}` is not carried: there is nothing like it here")
                elif name:
                    elements.append(child)

    def _check_scopes(self, document: Document, assembly: Assembly) -> None:
        """Tell of data that code elsewhere uses: here a variable belongs to one automaton."""
        texts = {automaton.id: "\n".join(_code_of(automaton)) for automaton in document.automata}
        for name, data, automaton in assembly.data:
            word = re.compile(rf"\b{re.escape(name)}\b")
            users = [
                other for other, text in texts.items() if other != automaton.number and word.search(text)
            ]
            if users:
                message = (
                    f"`{name[:60]}` is a variable of automaton {automaton.number} alone here, and code of "
                    f"automaton {users[0]} uses it: let it be `self.{name[:60]}`"
                )
                self._problems.approximate(data, message)


def _father(chart: ChartAutomaton) -> int:
    return chart.owner.automaton.number if chart.owner is not None else 0


def _code_of(automaton: Automaton) -> Iterable[str]:
    for state in automaton.states:
        yield from _texts(state, "entry", "code", "exit")
    for transition in automaton.transitions:
        yield from _texts(transition, "guard", "code")
        if transition.type == "condition":
            yield transition.trigger.text


def _texts(node: State | Transition, *names: str) -> Iterable[str]:
    return (getattr(node, name).text for name in names)
