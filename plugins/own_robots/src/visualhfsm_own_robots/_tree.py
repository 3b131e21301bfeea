"""A model's XML as a tree whose elements know their file and line, within limits."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from naoserver.errors import RobotError

LARGEST_FILE: Final = 10 << 20
"""Largest size of a model's file in bytes."""
MOST_ELEMENTS: Final = 50_000
DEEPEST: Final = 256
"""Most elements within each other; MuJoCo stops at 500."""
_MOST_ATTRIBUTES: Final = 200
"""Most attributes of an element."""
_LONGEST_NUMBER: Final = 400
_TEXTS: Final = re.compile(
    r"name|class|childclass|link|joint\d?|body\d?|site\d?|geom\d?|mesh|material|file|filename|\w*name|target"
)
"""Attributes whose values are names, even if they read as numbers."""
_COMMENT: Final = re.compile(rb"<!--.*?(?:-->|\Z)", re.DOTALL)
_POINTER: Final = b"version https://git-lfs.github.com/spec/"
"""The first bytes of a file whose content Git LFS has not fetched (git-lfs 3.7, docs/spec.md)."""
POINTER: Final = "is a pointer of Git LFS: run git lfs pull"


def is_pointer(content: bytes) -> bool:
    """Return whether a file has, in place of its content, where Git LFS finds it."""
    return content.startswith(_POINTER)


@dataclass(eq=False)
class Element:
    """An element, and the place in a file from which it comes."""

    tag: str
    attributes: dict[str, str]
    source: Path
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    @property
    def at(self) -> str:
        """Return file and line, as at the beginning of a message."""
        return f"{self.source}:{self.line}"

    @property
    def name(self) -> str:
        """Return its attribute `name`, empty if it has none."""
        return self.attributes.get("name", "")

    def get(self, name: str, default: str = "") -> str:
        """Return an attribute."""
        return self.attributes.get(name, default)

    def all(self, *tags: str) -> Iterator[Element]:
        """Yield this element and all within it in the order of the file; of some tags, if any are given."""
        waiting = [self]
        while waiting:
            element = waiting.pop()
            if not tags or element.tag in tags:
                yield element
            waiting += reversed(element.children)

    def within(self, *path: str) -> Iterator[Element]:
        """Yield the elements at a path of tags below this one."""
        found = [self]
        for tag in path:
            found = [child for element in found for child in element.children if child.tag == tag]
        yield from found

    def add(self, tag: str, **attributes: str) -> Element:
        """Return a new element at the end of this one, which is said to come from the same line."""
        self.children.append(Element(tag, attributes, self.source, self.line))
        return self.children[-1]

    def remove_where(self, unwanted: Callable[[Element], bool]) -> list[Element]:
        """Remove the elements within this one that are not wanted, with all in them; return them."""
        removed = []
        for parent in self.all():
            removed += [child for child in parent.children if unwanted(child)]
            parent.children = [child for child in parent.children if not unwanted(child)]
        return removed


Fault = tuple[Element, str]
"""An element that no model has, and what is wrong with it, and helps."""


def refuse(faults: Iterator[Fault]) -> None:
    """Raise RobotError, with file and line, for the first of some faults."""
    for element, what in faults:
        raise RobotError(f"{element.at}: {what}")


def read_tree(path: Path) -> Element:
    """Return the tree of an XML file. Raises RobotError when it cannot be read, is too large or malformed."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as problem:  # a name with a null character
        raise RobotError(f"{path}: cannot be read: {getattr(problem, 'strerror', problem)}") from None
    return parse_tree(content, path)


def parse_tree(content: bytes, path: Path, *, comments: bool = True) -> Element:
    """Return the tree of an XML text that comes from a file, which may have comments that are not XML.

    Raises RobotError, with file and line, for a text that is too large, not well-formed, has a document type
    or a number that is not finite.
    """
    if len(content) > LARGEST_FILE:
        raise RobotError(f"{path}: it is larger than {LARGEST_FILE >> 20} MB, which no model is")
    if is_pointer(content):
        raise RobotError(f"{path}: it {POINTER}")
    parser = expat.ParserCreate()
    top = Element("", {}, path, 0)
    around = [top]
    count = 0

    def begin(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        element = Element(tag, attributes, path, parser.CurrentLineNumber)
        count += 1
        if count > MOST_ELEMENTS:
            raise RobotError(f"{path}: it has more than {MOST_ELEMENTS} elements")
        if len(around) > DEEPEST:
            raise RobotError(f"{element.at}: more than {DEEPEST} elements within each other")
        if len(attributes) > _MOST_ATTRIBUTES:
            raise RobotError(f"{element.at}: <{tag[:60]}> has more than {_MOST_ATTRIBUTES} attributes")
        _require_finite(element)
        around[-1].children.append(element)
        around.append(element)

    def add(text: str) -> None:
        around[-1].text += text.strip()

    def declare(*_: object) -> None:
        at = f"{path}:{parser.CurrentLineNumber}"
        raise RobotError(f"{at}: it has a document type, which a model does not need: remove it")

    parser.buffer_text = True
    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _: around.pop()
    parser.CharacterDataHandler = add
    parser.StartDoctypeDeclHandler = declare
    try:
        parser.Parse(content, True)
    except expat.ExpatError as problem:
        # As MuJoCo's own reader, which reads no further than the root, and takes "--" in comments.
        if len(around) == 1 and top.children:
            return top.children[0]
        plain = _COMMENT.sub(lambda found: b"\n" * found[0].count(b"\n"), content)
        if comments and plain != content:
            return parse_tree(plain, path, comments=False)
        why = expat.ErrorString(problem.code)
        raise RobotError(f"{path}:{problem.lineno}: not XML: {why}") from None
    except (LookupError, ValueError) as problem:  # the encoding that its first line names
        raise RobotError(f"{path}:1: not XML: {problem}") from None
    return top.children[0]


def write_tree(root: Element) -> tuple[str, list[Element]]:
    """Return the tree as a text with an element in each line, and these elements: a line names an element."""
    lines: list[str] = []
    order = []

    def write(element: Element) -> None:
        order.append(element)
        values = "".join(f" {name}={quoteattr(value)}" for name, value in element.attributes.items())
        lines.append(f"<{element.tag}{values}>{escape(' '.join(element.text.split()))}")
        for child in element.children:
            write(child)
        lines[-1] += f"</{element.tag}>"

    write(root)
    return "\n".join(lines), order


def number(word: str) -> float | None:
    """Return the number that a word is, as C++ reads it; None if it is none."""
    if len(word) > _LONGEST_NUMBER or "_" in word:
        return None
    try:
        return float(word)
    except ValueError:
        return None


def numbers(element: Element, name: str, default: str = "") -> list[float]:
    """Return the numbers of an attribute. Raises RobotError when it has others than finite ones, or none."""
    text = element.get(name, default)
    found = [number(word) for word in text.split()]
    values = [value for value in found if value is not None and math.isfinite(value)]
    if not values or len(values) < len(found):
        hint = ", with a point before the decimals" if "," in text else ""
        hint = "; this is xacro: run xacro first" if "${" in text else hint
        raise RobotError(f"{element.at}: {name} of <{element.tag}> is {text[:60]!r}: write numbers{hint}")
    return values


def _require_finite(element: Element) -> None:
    """Raise RobotError for a value that has only numbers, but not only finite ones."""
    for name, value in element.attributes.items():
        found = [] if _TEXTS.fullmatch(name) else [number(word) for word in value.split()]
        if None not in found and not all(each is not None and math.isfinite(each) for each in found):
            raise RobotError(f"{element.at}: {name} of <{element.tag}> is {value[:60]!r}: it must be finite")
