"""Keep what SCXML has no word for: elements of the native format, in a namespace of our own.

An element is written as it stands in the native format, without what SCXML says of it. Where SCXML and such
an element both say something and differ, because another program has edited the file, SCXML counts.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from types import MappingProxyType
from typing import Final

from ..formats.xml_text import INDENT, attributes_text, escaped
from ..formats.xml_tree import XmlComment, XmlElement
from .vocabulary import INDEX, OWN_PREFIX, decode_name, decode_tag, encode_name, encode_tag

__all__ = ["is_plain_leaf", "native_element", "own_lines", "set_leaf", "with_comments"]

# Elements that hold elements: in all others white space counts.
_STRUCTURE: Final = frozenset(
    (
        *("VisualHFSM", "VisualStates", "SubAutomata", "state", "transition", "input"),
        *("parameters", "parameter", "events", "event", "properties", "property"),
        *("libraries", "config", "iceinterface"),
    )
)


def own_lines(
    native: XmlElement,
    depth: int,
    left_out: Collection[XmlElement | XmlComment] = (),
    order: Mapping[XmlElement, int] = MappingProxyType({}),
) -> Iterator[str]:
    """Yield the lines of a native element in our namespace, without the children that are `left_out`.

    `order` has the elements that say at which place they stand in the native document.
    """
    indent = INDENT * depth
    tag = f"{OWN_PREFIX}:{encode_tag(native.tag)}"
    start = f"{indent}<{tag}{_attributes(native)}"
    if native in order:
        start += f' {OWN_PREFIX}:{INDEX}="{order[native]}"'
    if native.tag not in _STRUCTURE or native.text.strip():
        content = _content(native)
        yield f"{start}>{content}</{tag}>" if content else f"{start}/>"
        return
    children = [child for child in native.children if child not in left_out]
    if not children:
        yield f"{start}/>"
        return
    yield f"{start}>"
    for child in children:
        if isinstance(child, XmlComment):
            yield f"{indent}{INDENT}<!--{child.text}-->"
        else:
            yield from own_lines(child, depth + 1, (), order)
    yield f"{indent}</{tag}>"


def native_element(own: XmlElement, origins: dict[XmlElement, XmlElement]) -> XmlElement:
    """Return the native element that an element of our namespace stands for.

    `origins` gets what it and the elements in it were made of.
    """
    local = own.tag.rpartition(":")[2]
    attributes = {
        decode_name(name): value
        for name, value in own.attributes.items()
        if ":" not in name and name != "xmlns"
    }
    native = XmlElement(decode_tag(local), attributes, own.line, own.column)
    native.text, native.text_line, native.text_column = own.text, own.text_line, own.text_column
    native.head, native.tail = own.head, own.tail
    origins[native] = own
    native.children = [
        XmlComment(child.text, child.tail)
        if isinstance(child, XmlComment)
        else native_element(child, origins)
        for child in own.children
    ]
    return native


def with_comments(parent: XmlElement) -> Iterator[tuple[list[XmlComment], XmlElement]]:
    """Yield the elements inside an element, each with the comments directly before it."""
    comments: list[XmlComment] = []
    for child in parent.children:
        if isinstance(child, XmlComment):
            comments.append(child)
        else:
            yield comments, child
            comments = []


def is_plain_leaf(comments: Collection[XmlComment], leaf: XmlElement, known: Collection[str] = ()) -> bool:
    """Return whether a leaf has nothing but its text and the attributes that are `known`."""
    return not comments and not leaf.children and all(name in known for name in leaf.attributes)


def set_leaf(parent: XmlElement, tag: str, text: str, source: XmlElement, **attributes: str) -> None:
    """Let an element have a leaf with this text, of which it keeps what else it has.

    `source` is where the text stands. Without a text there need not be a leaf.
    """
    leaf = next((child for child in parent.elements() if child.tag == tag), None)
    if leaf is None:
        if not text and not attributes:
            return
        leaf = XmlElement(tag, {}, source.line, source.column)
        # In front, since comments at the end belong to no leaf.
        parent.children.insert(0, leaf)
    leaf.attributes.update(attributes)
    if leaf.text != text:
        leaf.text = leaf.head = text
        leaf.text_line, leaf.text_column = source.text_line, source.text_column
        for child in leaf.children:
            child.tail = ""


def _content(native: XmlElement) -> str:
    parts = [escaped(native.head if native.children else native.text)]
    for child in native.children:
        if isinstance(child, XmlComment):
            parts.append(f"<!--{child.text}-->")
        else:
            tag = f"{OWN_PREFIX}:{encode_tag(child.tag)}"
            content = _content(child)
            start = f"<{tag}{_attributes(child)}"
            parts.append(f"{start}>{content}</{tag}>" if content else f"{start}/>")
        parts.append(escaped(child.tail))
    return "".join(parts)


def _attributes(native: XmlElement) -> str:
    return attributes_text(tuple((encode_name(name), value) for name, value in native.attributes.items()))
