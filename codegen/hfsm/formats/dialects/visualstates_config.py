"""Read what VisualStates' documents say about the whole component: interfaces, libraries, parameters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from ...document import Comment, Extra, Interface, Library, Parameter, Text
from ..xml_tree import XmlElement
from .elements import ElementReader
from .native import INTERFACE_TAGS
from .parts import NOTHING, Parts, node_fields, own_text, text_of

__all__ = ["read_interfaces", "read_libraries", "read_parameters"]

_INTERFACE: Final = {
    "name": "nameinterface",
    "proxyName": "nameproxy",
    "proxyname": "nameproxy",
    "ip": "ip",
    "port": "port",
    "interfaceName": "interface",
    "interface": "interface",
}
_PARAMETER_TYPES: Final = {
    "Boolean": "bool",
    "Integer": "int",
    "Float": "float",
    "String": "str",
    "Character": "str",
}


def read_interfaces(
    reader: ElementReader, config: XmlElement | None, oldest: XmlElement | None
) -> tuple[tuple[Interface, ...], tuple[Extra, ...]]:
    """Return the interfaces of a component, and what else its configuration says.

    `config` holds a list of interfaces, or what ROS needs to know; `oldest` is the list of August 2017.
    """
    inside = NOTHING if config is None else reader.parts(
        config, containers=("interfaces",), taken=("iceinterface",)
    )  # fmt: skip
    listed = inside.first("interfaces")
    newer = NOTHING if listed is None else reader.parts(listed, ("interface",), taken=("iceinterface",))
    older = NOTHING if oldest is None else reader.parts(oldest, ("config",), taken=("iceinterface",))
    found = [_interface(reader, each, newer.comments_before(each)) for each in newer.all("interface")]
    found += [_interface(reader, each, older.comments_before(each)) for each in older.all("config")]
    extras = inside.lost_details({"interfaces": ""}) + inside.extras + newer.extras + older.extras
    return tuple(found), extras


def _interface(reader: ElementReader, element: XmlElement, comments: tuple[Comment, ...]) -> Interface:
    parts = reader.parts(element, leaves=_INTERFACE, taken=INTERFACE_TAGS)
    proxy = parts.first("proxyName") or parts.first("proxyname")
    ip, port = parts.first("ip"), parts.first("port")
    return Interface(
        name=text_of(parts.first("name")).text,
        proxy=None if proxy is None else proxy.text,
        ip=None if ip is None else ip.text,
        port=None if port is None else port.text,
        type=text_of(parts.first("interfaceName") or parts.first("interface")).text,
        **node_fields(element, parts, comments=comments, native=_INTERFACE),
    )


def read_libraries(
    reader: ElementReader, container: XmlElement | None
) -> tuple[tuple[Library, ...], tuple[Extra, ...]]:
    """Return the libraries of a component, and what else stands among them."""
    parts = NOTHING if container is None else reader.parts(container, nodes=("library", "lib"))
    elements = sorted(parts.all("library") + parts.all("lib"), key=lambda each: (each.line, each.column))
    libraries = tuple(
        Library(
            name=text_of(each),
            **node_fields(each, own_text(each, "lib"), comments=parts.comments_before(each)),
        )
        for each in elements
    )
    return libraries, parts.extras


def read_parameters(reader: ElementReader, namespaces: Iterable[Parts]) -> tuple[Parameter, ...]:
    """Return the parameters of all namespaces; those that cannot be ours are told."""
    found: dict[str, Parameter] = {}
    for namespace in namespaces:
        for container in namespace.all("parameters"):
            for element in container.elements():
                parameter = _parameter(element) if element.tag == "param" else None
                if parameter is None or parameter.name in found:
                    name = element.attributes.get("name", "")
                    reader.remark(element, f"the parameter `{name}` is kept, and not used")
                else:
                    found[parameter.name] = parameter
    return tuple(found.values())


def _parameter(element: XmlElement) -> Parameter | None:
    """Return a parameter of the component, or None when its name or its type are none of Python."""
    name = element.attributes.get("name", "").strip()
    kind = _PARAMETER_TYPES.get(element.attributes.get("type", ""))
    if kind is None or not name.isidentifier():
        return None
    inside = {each.tag: each for each in element.elements()}
    value = text_of(inside.get("value"))
    return Parameter(
        name=name,
        type=Text(kind, element.line, element.column),
        default=Text(_literal(kind, value.text), value.line, value.column),
        description=text_of(inside.get("description")),
        line=element.line,
        column=element.column,
    )


def _literal(kind: str, value: str) -> str:
    if kind == "str":
        return repr(value)
    if kind == "bool":
        return {"true": "True", "false": "False"}.get(value.strip().lower(), value)
    return value.strip()
