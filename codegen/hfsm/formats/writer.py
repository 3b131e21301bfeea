"""Write an automaton document in the native format, with a fixed order and unchanged code."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from codegen.hfsm.formats.schema import DOCUMENT, Items, Leaf, NodeKind

from ..document import NO_CHILD, Comment, Document, Element, Extra, Node, Text, Transition

UNWRITABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not allow, not even as a reference."""

_INDENT: Final = "  "
_TEXT_ESCAPES: Final = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"})
_ATTRIBUTE_ESCAPES: Final = _TEXT_ESCAPES | str.maketrans({'"': "&quot;", "\n": "&#10;", "\t": "&#9;"})


class DocumentNotWritableError(ValueError):
    """A text of the document has a character that XML does not allow."""


def write_document(document: Document) -> str:
    """Return the text of the document's file, which ends with a newline.

    Raises DocumentNotWritableError.
    """
    writer = _Writer({each.tag: each for each in document.lists})
    writer.node(document, replace(DOCUMENT, tag=document.root_tag))
    return "\n".join((*writer.lines, ""))


class _Writer:
    def __init__(self, lists: Mapping[str, Element]) -> None:
        self.lines: list[str] = ['<?xml version="1.0" encoding="UTF-8"?>']
        self._lists = lists
        self._depth = 0

    def node(self, node: Node, kind: NodeKind) -> None:
        """Write an element of the model with its content."""
        self._extras(node.comments)
        attributes = tuple(
            (name, _text(value))
            for name, leaf in kind.attributes.items()
            if (value := getattr(node, leaf.field)) != leaf.default or not leaf.optional
        )
        start = f"<{kind.tag}{_attributes(attributes + node.attributes)}>"
        if kind.text:
            if node.extras:
                raise DocumentNotWritableError(f"`{kind.tag}` can only have text")
            self._line(f"{start}{_escaped(getattr(node, kind.text).text)}</{kind.tag}>")
            return
        if not kind.children and not node.extras:
            self._line(f"{start[:-1]}/>")
            return
        self._line(start)
        self._depth += 1
        for tag, child in kind.children.items():
            if isinstance(child, Leaf):
                self._leaf(tag, child, node)
            elif child.listed:
                self._list(child, self._lists.get(tag, Element(tag)), getattr(node, child.field))
            else:
                found = getattr(node, child.field)
                for each in (found,) if isinstance(found, Node) else found or ():
                    self.node(each, child.kind)
        self._extras(node.extras)
        self._depth -= 1
        self._line(f"</{kind.tag}>")

    def _list(self, items: Items, around: Element, nodes: Sequence[Node]) -> None:
        """Write a list of the document with its other content."""
        start = f"{around.tag}{_attributes(around.attributes)}"
        if nodes or around.children:
            self._line(f"<{start}>")
            self._depth += 1
            for each in nodes:
                self.node(each, items.kind)
            self._extras(around.children)
            self._depth -= 1
            self._line(f"</{around.tag}>")
        elif around.attributes or not items.optional:
            self._line(f"<{start}/>")

    def _leaf(self, tag: str, leaf: Leaf, node: Node) -> None:
        value = getattr(node, leaf.field)
        if leaf.optional and value == leaf.default:
            return
        attributes = (
            _attributes([("type", node.type)]) if isinstance(node, Transition) and tag == "trans" else ""
        )
        first = value[:1] or (NO_CHILD,) if isinstance(value, tuple) else (value,)
        for each in value[1:] if leaf.repeats else first:
            self._line(f"<{tag}{attributes}>{_escaped(_text(each))}</{tag}>")

    def _extras(self, extras: Sequence[Extra]) -> None:
        for extra in extras:
            if isinstance(extra, Comment):
                if "--" in extra.text or extra.text.endswith("-"):
                    raise DocumentNotWritableError("a comment cannot contain `--` or end with `-`")
                self._line(f"<!--{_checked(extra.text)}-->")
                continue
            start = f"<{extra.tag}{_attributes(extra.attributes)}"
            if extra.children:
                self._line(f"{start}>")
                self._depth += 1
                self._extras(extra.children)
                self._depth -= 1
                self._line(f"</{extra.tag}>")
            else:
                self._line(f"{start}>{_escaped(extra.text)}</{extra.tag}>" if extra.text else f"{start}/>")

    def _line(self, text: str) -> None:
        self.lines.append(_INDENT * self._depth + text)


def _attributes(attributes: Sequence[tuple[str, str]]) -> str:
    """Return the attributes of a start tag, each after a space."""
    return "".join(f' {name}="{_escaped(value, _ATTRIBUTE_ESCAPES)}"' for name, value in attributes)


def _escaped(text: str, escapes: Mapping[int, str] = _TEXT_ESCAPES) -> str:
    return _checked(text).translate(escapes)


def _checked(text: str) -> str:
    found = UNWRITABLE.search(text)
    if found:
        raise DocumentNotWritableError(
            f"XML does not allow the character {found.group()!r} in `{text[:40]!r}`"
        )
    return text


def _text(value: object) -> str:
    match value:
        case Text():
            return value.text
        case bool():
            return "true" if value else "false"
        case float():
            return str(int(value)) if value.is_integer() else repr(value)
    return str(value)
