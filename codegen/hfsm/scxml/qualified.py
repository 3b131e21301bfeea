"""Tell to whom the elements of a file belong: to SCXML, to us, or to another program."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum, auto

from ..formats.xml_tree import XmlComment, XmlElement
from .vocabulary import OWN_NAMESPACE, SCXML_NAMESPACE, decode_tag

__all__ = ["Owner", "QualifiedTree", "local_name"]


class Owner(Enum):
    """Whose word an element is."""

    SCXML = auto()
    OWN = auto()
    OTHER = auto()


def local_name(tag: str) -> str:
    """Return the name of an element without its prefix."""
    return tag.rpartition(":")[2]


class QualifiedTree:
    """The elements below a root with their namespaces; without any declared they are SCXML's."""

    def __init__(self, root: XmlElement) -> None:
        self._owners: dict[XmlElement, Owner] = {}
        self._own_attributes: dict[XmlElement, dict[str, str]] = {}
        self.has_own = False
        self._qualify(root, {"": SCXML_NAMESPACE})

    def scxml(self, element: XmlElement) -> str:
        """Return the name of an element of SCXML, blank for any other."""
        return local_name(element.tag) if self._owners[element] is Owner.SCXML else ""

    def own(self, element: XmlElement) -> str:
        """Return the native name of an element of ours, blank for any other."""
        return decode_tag(local_name(element.tag)) if self._owners[element] is Owner.OWN else ""

    def own_attribute(self, element: XmlElement, name: str) -> str | None:
        """Return an attribute of our namespace, or None."""
        return self._own_attributes.get(element, {}).get(name)

    def inside(self, element: XmlElement, *names: str) -> Iterator[XmlElement]:
        """Yield the elements of SCXML with these names, or all, directly inside an element."""
        for child in element.elements():
            name = self.scxml(child)
            if name and (not names or name in names):
                yield child

    def everywhere(self, element: XmlElement, *names: str) -> Iterator[XmlElement]:
        """Yield the elements of SCXML with these names at any depth inside an element."""
        for child in element.elements():
            if self.scxml(child) in names:
                yield child
            yield from self.everywhere(child, *names)

    def own_inside(self, element: XmlElement, name: str) -> XmlElement | None:
        """Return the first element of ours with a name directly inside an element, or None."""
        return next((child for child in element.elements() if self.own(child) == name), None)

    def is_other(self, element: XmlElement) -> bool:
        """Return whether an element belongs to another program."""
        return self._owners[element] is Owner.OTHER

    def _qualify(self, element: XmlElement, around: dict[str, str]) -> None:
        declared = {
            name.partition(":")[2]: value
            for name, value in element.attributes.items()
            if name == "xmlns" or name.startswith("xmlns:")
        }
        namespaces = {**around, **declared} if declared else around
        prefix = element.tag.rpartition(":")[0]
        namespace = namespaces.get(prefix)
        if namespace == SCXML_NAMESPACE or (prefix == "" and not namespace):
            self._owners[element] = Owner.SCXML
        elif namespace == OWN_NAMESPACE:
            self._owners[element] = Owner.OWN
            self.has_own = True
        else:
            self._owners[element] = Owner.OTHER
        for name, value in element.attributes.items():
            space, _, local = name.rpartition(":")
            if space and namespaces.get(space) == OWN_NAMESPACE:
                self._own_attributes.setdefault(element, {})[local] = value
        for child in element.children:
            if not isinstance(child, XmlComment):
                self._qualify(child, namespaces)
