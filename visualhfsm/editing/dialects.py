"""Tell whether a file is in the format in which documents are saved."""

from __future__ import annotations

from typing import Final
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring

from codegen.hfsm.formats.dialects import Dialect, dialect_of
from codegen.hfsm.formats.xml_tree import XmlElement

__all__ = ["NATIVE", "dialect_of_file"]

NATIVE: Final[str] = Dialect.NATIVE.value
_LEVELS: Final = 2
"""Levels below the root that tell the dialects apart."""


def dialect_of_file(content: bytes) -> str:
    """Return the name of the dialect of a document; of one that cannot be read, the native one."""
    try:
        root = fromstring(content, forbid_dtd=True)
    except (ParseError, DefusedXmlException, ValueError, LookupError):
        return NATIVE
    return dialect_of(_head(root, _LEVELS)).value


def _head(element: Element, levels: int) -> XmlElement:
    children: list[XmlElement] = []
    if levels:
        children = [_head(child, levels - 1) for child in element if isinstance(child.tag, str)]
    return XmlElement(element.tag, dict(element.attrib), 0, 0, children=[*children])
