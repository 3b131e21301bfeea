"""Compare two versions of a document, element by element."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import fields
from difflib import unified_diff
from itertools import islice
from operator import attrgetter
from typing import Any, Final, Literal, TypeVar

import msgspec

from codegen.hfsm import document as model

from .places import Place

_NodeT = TypeVar("_NodeT", bound=model.Node)

KEYS: Final[dict[str, Callable[[Any], Hashable]]] = {
    **dict.fromkeys(("automata", "states", "transitions", "annotations"), attrgetter("id")),
    **dict.fromkeys(("parameters", "inputs", "outputs", "events", "properties"), attrgetter("name")),
    "survives": attrgetter("part", "kind"),
    **dict.fromkeys(("interfaces", "ros"), attrgetter("name")),
    "libraries": attrgetter("name.text"),
    **dict.fromkeys(("arguments", "results"), attrgetter("name", "child")),
}
"""The key by which elements are matched, for each field that holds some."""

_PARTS: Final[dict[tuple[type[model.Node], str], str]] = {
    (model.Document, "on_error"): "onError",
    (model.Document, "on_refused"): "onRefused",
    (model.Automaton, "iteration_time"): "period",
    (model.Automaton, "imported"): "import",
    (model.Transition, "code"): "fired",
}
_POSITION: Final = frozenset(("x", "y"))
_ONE_LINE: Final = 60
"""The most characters of texts that are shown beside each other."""
_UNSEEN: Final = frozenset(("attributes", "comments", "extras", "lists", "root_tag"))


class Difference(msgspec.Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """A difference: a whole element, or a `part` of one with its text before and after.

    Of a text of several lines, `lines` are those that differ, for who asks.

    Elements that the editor does not know are the part `other`.
    """

    kind: Literal["added", "removed", "changed", "moved"]
    place: Place
    part: str = ""
    before: str = ""
    after: str = ""
    lines: tuple[str, ...] = ()


def diff_documents(before: model.Document, after: model.Document) -> list[Difference]:
    """Return the differences between two versions, in the order of `after`, the later one.

    Automata, states, transitions and annotations are matched by their ids, other things by their names.
    """
    return list(_nodes(before, after, Place(kind="document")))


def differ(one: model.Document, other: model.Document) -> bool:
    """Return whether two versions differ in more than positions."""
    return any(each.kind != "moved" for each in diff_documents(one, other))


def changed_lines(difference: Difference) -> Iterator[str]:
    """Yield the lines that differ in a changed longer text, as `diff -u` has them; none for a short one."""
    texts = (difference.before, difference.after)
    if difference.kind == "changed" and any("\n" in text or len(text) > _ONE_LINE for text in texts):
        before, after = (text.splitlines() for text in texts)
        lines = unified_diff(before, after, n=1, lineterm="")
        yield from (line for line in islice(lines, 2, None) if not line.startswith("@@"))


def _nodes(before: model.Node, after: model.Node, place: Place) -> Iterator[Difference]:
    differing = [name for name in compared_fields(after) if getattr(before, name) != getattr(after, name)]
    for name in differing:
        old, new = getattr(before, name), getattr(after, name)
        if name in KEYS:
            yield from _lists(name, old, new, place)
        elif name not in _POSITION | _UNSEEN:
            part = part_of(after, name)
            yield Difference(kind="changed", place=place, part=part, before=shown(old), after=shown(new))
    if not _POSITION.isdisjoint(differing):
        old, new = (", ".join(shown(getattr(each, axis)) for axis in ("x", "y")) for each in (before, after))
        yield Difference(kind="moved", place=place, before=old, after=new)
    if not _UNSEEN.isdisjoint(differing):
        yield Difference(kind="changed", place=place, part="other")


def _lists(
    name: str, before: tuple[model.Node, ...], after: tuple[model.Node, ...], place: Place
) -> Iterator[Difference]:
    old, new = keyed(name, before), keyed(name, after)
    for index, (key, item) in enumerate(new.items()):
        at = _place_of(place, name, item, index)
        if key in old:
            yield from _nodes(old[key], item, at)
        else:
            yield Difference(kind="added", place=at, after=shown(item))
    for index, (key, item) in enumerate(old.items()):
        if key not in new:
            at = _place_of(place, name, item, index)
            yield Difference(kind="removed", place=at, before=shown(item))
    if [key for key in old if key in new] != [key for key in new if key in old]:
        yield Difference(kind="changed", place=place, part=f"{name} order")


def keyed(name: str, items: Sequence[_NodeT]) -> dict[Hashable, _NodeT]:
    """Return the elements of a field by their keys; equal keys are numbered."""
    seen: Counter[Hashable] = Counter()
    found: dict[Hashable, _NodeT] = {}
    for item in items:
        key = KEYS[name](item)
        found[key, seen[key]] = item
        seen[key] += 1
    return found


def compared_fields(node: model.Node) -> list[str]:
    """Return the names of the fields of an element that are compared."""
    return [each.name for each in fields(node) if each.compare]


def _place_of(parent: Place, name: str, item: model.Node, index: int) -> Place:
    """Return the place of an element in the field `name` of the element at `parent`."""
    match item:
        case model.Automaton():
            return Place(kind="automaton", automaton=item.id)
        case model.State():
            return Place(kind="state", automaton=parent.automaton, id=item.id)
        case model.Transition():
            return Place(kind="transition", automaton=parent.automaton, id=item.id)
        case model.Annotation():
            return Place(kind="annotation", automaton=parent.automaton, id=item.id)
        case model.Argument():
            return msgspec.structs.replace(parent, part="argument", name=item.name, child=item.child)
        case model.Result():
            return msgspec.structs.replace(parent, part="result", name=item.name, child=item.child)
    return Place(kind=parent.kind, automaton=parent.automaton, part=name, index=index)


def part_of(node: model.Node, name: str) -> str:
    """Return the name of a field of an element in a place."""
    return _PARTS.get((type(node), name), name)


def first_line(text: str) -> str:
    """Return the first line of a text that has letters in it, blank if it has none."""
    return next((line.strip() for line in text.splitlines() if line.strip()), "")


def shown(value: object) -> str:
    """Return a value of a field as text for people; an element is shown by its name."""
    match value:
        case None:
            return ""
        case model.Text():
            return value.text
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:g}"
        case tuple():
            return ", ".join(shown(each) for each in value)
        case model.Import():
            return value.file.text
        case model.Annotation():
            return first_line(value.text.text)
        case model.Survives():
            return value.failure
        case model.Node():
            return shown(getattr(value, "name", ""))
    return str(value)
