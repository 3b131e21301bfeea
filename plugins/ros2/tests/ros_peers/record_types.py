"""Print what genuine ROS makes of messages, as JSON: run by the Python of the peers' environment.

`make ros-recordings` writes the output to plugins/ros2/tests/data/ros2/types.json. It has

- `hashes`: the RIHS01 hash of every type that the wheels of rclpy have, as rosidl wrote it when they were built;
- `cdr`: messages of these types, each as its values and the bytes that `rclpy.serialization` makes of them; and
  messages of other types, with the bytes that Cyclone DDS makes of them, another implementation of CDR;
- `definitions`: services of the wheels as text; and types that the wheels do not have, as text, with the hashes that
  rosidl's own generator gives them. The text of those of the standard packages comes from rosbags.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stdout
from itertools import count
from pathlib import Path
from typing import Any, Final

from cyclonedds.idl import make_idl_struct, types
from rclpy.serialization import serialize_message
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosidl_adapter.action import convert_action_to_idl
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_type_description import generate_type_hash

SHARE: Final = Path(sys.prefix, "share")
UNUSED: Final = ("rmw_dds_common", "rosidl_generator_type_description")
STANDARD: Final = ("actionlib_msgs", "shape_msgs", "stereo_msgs", "tf2_msgs", "visualization_msgs")
"""Packages of rosbags' types for Jazzy that the wheels do not have."""
WRITTEN: Final = ("control_msgs", "naoqi_bridge_msgs", "smach_msgs", "tf2_msgs", "vision_msgs")
"""Packages of messages that the wheels do not have, and that are recorded as Cyclone DDS writes them."""
OWN: Final = {
    "example_interfaces/srv/AddTwoInts": "int64 a\nint64 b\n---\nint64 sum\n",
    "example_interfaces/action/Fibonacci": "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n",
    "std_srvs/srv/Empty": "---\n",
    "std_srvs/srv/SetBool": "bool data\n---\nbool success\nstring message\n",
    "std_srvs/srv/Trigger": "---\nbool success\nstring message\n",
    "peer_msgs/msg/Ball": "std_msgs/Header header\nstring<=12 colour\nfloat32[3] place\ngeometry_msgs/Point[] track\n"
    "uint8 NONE=0\nuint8[<=5] marks\nbyte[4] raw\nchar letter\nbool[] seen\n",
    "peer_msgs/srv/Find": "peer_msgs/Ball like\nduration_msgs/Span[<=2] when\n---\nBall[2] found\n",
    "peer_msgs/action/Fetch": "Ball ball\n---\nfloat64 seconds\n---\ngeometry_msgs/PoseStamped at\n",
    "duration_msgs/msg/Span": "builtin_interfaces/Time start\nbuiltin_interfaces/Duration length\n",
}
"""Types of users, with what the grammar allows, and some of other packages."""
OURS: Final = Path(__file__).parents[2] / "src" / "zenoh_ros2" / "definitions"
"""What rosbags lacks and our package brings: these texts are recorded, too."""
WORDS: Final = ("", "x", "Grüße", "joint_1", "日本", "a longer text, so that what follows moves")
PLAIN: Final = {"bool": "int8", "byte": "int8", "char": "uint8"}
"""Types of Cyclone DDS that are written like those of ROS."""
NOTATION: Final = {
    "bool": "boolean",
    "byte": "octet",
    "char": "uint8",
    "float32": "float",
    "float64": "double",
}
LIMITS: Final = {f"{sign}int{bits}": bits for bits in (8, 16, 32, 64) for sign in ("", "u")}


def value_of(kind: str, numbers: Iterator[int]) -> Any:
    """Return a value of a type in rclpy's notation, as JSON, other than that of its neighbors."""
    n = next(numbers)
    if found := re.fullmatch(r"(.+)\[(\d+)\]", kind):
        return [value_of(found[1], numbers) for _ in range(int(found[2]))]
    if found := re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", kind):
        return [value_of(found[1], numbers) for _ in range(min(n % 4, int(found[2] or 4)))]
    if kind in LIMITS:
        top = (1 << LIMITS[kind]) - 1
        number = (n * 2654435761 + 97) & top
        return number if kind.startswith("u") or number <= top >> 1 else number - top - 1
    if kind in {"float", "double"}:
        return (-1) ** n * (n + 0.625)
    if kind == "boolean":
        return n % 2 == 1
    if kind == "octet":
        return n * 37 % 256 - 128  # with a sign, as rosbags has it
    if kind.startswith(("string", "wstring")):
        return WORDS[n % len(WORDS)]
    return {
        name: value_of(each, numbers)
        for name, each in message_class(kind).get_fields_and_field_types().items()
    }


def message_class(name: str) -> Any:
    package, *folder, plain = name.split("/")
    if "_" in plain:  # the request or response of a service
        service, _, part = plain.rpartition("_")
        return getattr(getattr(importlib.import_module(f"{package}.srv"), service), part)
    return getattr(importlib.import_module(f"{package}.{folder[0] if folder else 'msg'}"), plain)


def fill(message: Any, values: dict[str, Any]) -> Any:
    """Set the fields of a message of rclpy to values in JSON."""
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, converted(kind, values[name]))
    return message


def converted(kind: str, value: Any) -> Any:
    if found := re.fullmatch(r"(.+)\[\d+\]|sequence<(.+?)(?:, \d+)?>", kind):
        return [converted(found[1] or found[2], each) for each in value]
    if kind == "octet":
        return bytes([value % 256])
    return fill(message_class(kind)(), value) if "/" in kind else value


def plain(value: Any) -> Any:
    """Return a value of a field as JSON."""
    if hasattr(value, "get_fields_and_field_types"):
        return {field: plain(getattr(value, field)) for field in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return int.from_bytes(value, signed=True)
    if hasattr(value, "tolist"):
        return value.tolist()
    return value if isinstance(value, bool | int | float | str) else [plain(each) for each in value]


def dds_messages(store: Any, names: list[str]) -> list[dict[str, Any]]:
    """Return a filled message of each type, as Cyclone DDS writes it."""
    classes: dict[str, Any] = {}

    def dds_type(kind: Any) -> Any:
        node, (detail, size) = kind if kind[0] != Nodetype.NAME else (kind[0], (kind[1], 0))
        if node == Nodetype.BASE:
            return str if detail == "string" else getattr(types, PLAIN.get(detail, detail))
        if node == Nodetype.NAME:
            return dds_class(detail)
        return (
            types.array[dds_type(detail), size]
            if node == Nodetype.ARRAY
            else types.sequence[dds_type(detail)]
        )

    def dds_class(name: str) -> Any:
        if name not in classes:
            fields = {field: dds_type(kind) for field, kind in store.fielddefs[name][1]}
            classes[name] = make_idl_struct(name.replace("/", "_"), name.replace("/", "::"), fields)
        return classes[name]

    def filled(kind: Any, numbers: Iterator[int]) -> tuple[Any, Any]:
        """Return a value as JSON, and for Cyclone DDS."""
        if kind[0] == Nodetype.BASE:
            detail = kind[1][0]
            value = value_of(NOTATION.get(detail, detail), numbers)
            return value, value
        if kind[0] == Nodetype.NAME:
            found = {field: filled(each, numbers) for field, each in store.fielddefs[kind[1]][1]}
            message = dds_class(kind[1])(**{field: made for field, (_, made) in found.items()})
            return {field: value for field, (value, _) in found.items()}, message
        element, size = kind[1]
        length = size if kind[0] == Nodetype.ARRAY else next(numbers) % 4
        pairs = [filled(element, numbers) for _ in range(length)]
        return [value for value, _ in pairs], [made for _, made in pairs]

    messages = []
    for name in names:
        values, message = filled((Nodetype.NAME, name), count(len(name)))
        messages.append({"type": name, "values": values, "cdr": message.serialize(use_version_2=False).hex()})
    return messages


def without(definitions: dict[str, str], names: dict[str, str]) -> dict[str, str]:
    return {name: text for name, text in sorted(definitions.items()) if name not in names}


def recorded_services(hashes: dict[str, str]) -> dict[str, dict[str, Any]]:
    """Return the services of the wheels as text."""
    services = {}
    for path in sorted(SHARE.glob("*/srv/*.srv")):
        name = "/".join(path.with_suffix("").parts[-3:])
        services[name] = {"text": path.read_text("utf-8"), "hashes": hashes_of(name, hashes)}
    return services


def hashes_of(name: str, hashes: dict[str, str]) -> dict[str, str]:
    """Return the hashes of a type and of its parts."""
    return {
        each: value for each, value in sorted(hashes.items()) if each == name or each.startswith(f"{name}_")
    }


def recorded_hashes() -> dict[str, str]:
    """Return the hashes of all types that the wheels have."""
    hashes: dict[str, str] = {}
    for path in sorted(SHARE.glob("*/*/*.json")):
        if path.parts[-3] not in UNUSED:
            for each in json.loads(path.read_text("utf-8"))["type_hashes"]:
                assert hashes.setdefault(each["type_name"], each["hash_string"]) == each["hash_string"]
    return hashes


def recorded_messages(names: list[str]) -> list[dict[str, Any]]:
    """Return three messages of each type: empty, and filled in two ways."""
    messages = []
    for name in names:
        made = message_class(name)
        fields = made.get_fields_and_field_types()
        empty = {field: plain(getattr(made(), field)) for field in fields}
        messages.append({"type": name, "values": empty, "cdr": bytes(serialize_message(made())).hex()})
        for first in (1, 38) if fields else ():
            numbers = count(first)
            values = {field: value_of(kind, numbers) for field, kind in fields.items()}
            cdr = bytes(serialize_message(fill(made(), values))).hex()
            messages.append({"type": name, "values": values, "cdr": cdr})
    return messages


def generated_hashes(definitions: dict[str, str], folder: Path) -> dict[str, dict[str, Any]]:
    """Return each definition with the hashes that rosidl's generator gives it and its parts."""
    convert = {"msg": convert_msg_to_idl, "srv": convert_srv_to_idl, "action": convert_action_to_idl}
    packages: dict[str, list[str]] = {}
    for name, text in definitions.items():
        package, kind, plain = name.split("/")
        place = folder / package / kind
        place.mkdir(parents=True, exist_ok=True)
        (place / f"{plain}.{kind}").write_text(text, "utf-8")
        convert[kind](folder / package, package, Path(kind, f"{plain}.{kind}"), place)
        packages.setdefault(package, []).append(f"{kind}/{plain}.idl")
    found: dict[str, str] = {}
    ready = {path.parent.parent.name: path.parent.parent for path in SHARE.glob("*/msg/*.json")}
    waiting = dict(packages)
    while waiting:
        for package, files in sorted(waiting.items()):
            arguments = {
                "package_name": package,
                "output_dir": str(folder / "out" / package),
                "idl_tuples": [f"{folder / package}:{each}" for each in files],
                "include_paths": [f"{each}:{place}" for each, place in ready.items()],
            }
            (folder / "arguments.json").write_text(json.dumps(arguments), "utf-8")
            try:
                written = generate_type_hash(str(folder / "arguments.json"))
            except KeyError:
                continue  # it needs a package whose turn is still to come
            for path in written:
                for each in json.loads(path.read_text("utf-8"))["type_hashes"]:
                    found[each["type_name"]] = each["hash_string"]
            ready[package] = folder / "out" / package
            del waiting[package]
            break
        else:
            raise SystemExit(f"packages that need one another: {sorted(waiting)}")
    return {name: {"text": text, "hashes": hashes_of(name, found)} for name, text in definitions.items()}


def main() -> None:
    # Fast CDR leaves padding as it finds it in memory: let the C library fill what it allocates with zeros.
    zeros = "glibc.malloc.tcache_count=0:glibc.malloc.perturb=255"
    if os.environ.get("GLIBC_TUNABLES") != zeros:
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | {"GLIBC_TUNABLES": zeros})
    hashes = recorded_hashes()
    store = get_typestore(Stores.ROS2_JAZZY)
    standard = {
        name: store.generate_msgdef(name, ros_version=2)[0].partition("\n====")[0] + "\n"
        for name in sorted(store.types)
        if name.startswith(STANDARD)
    }
    names = sorted(
        name for name in hashes if name.split("/")[1] == "msg" or name.endswith(("_Request", "_Response"))
    )
    # Converters report what they read and write.
    with tempfile.TemporaryDirectory() as folder, redirect_stdout(sys.stderr):
        ours = {
            "/".join(each.with_suffix("").parts[-3:]): each.read_text("utf-8") for each in OURS.glob("*/*/*")
        }
        definitions = generated_hashes(standard | OWN | without(ours, hashes), Path(folder))
        definitions |= recorded_services(hashes)
    others = [name for name in definitions if "/msg/" in name and name.startswith(WRITTEN)]
    for name in others:
        if name not in store.types:
            store.register(get_types_from_msg(definitions[name]["text"], name))
    messages = recorded_messages(names) + dds_messages(store, others)
    lines = ",\n".join(json.dumps(each, ensure_ascii=False, sort_keys=True) for each in messages)
    rest = json.dumps(
        {"definitions": definitions, "hashes": hashes}, indent=1, ensure_ascii=False, sort_keys=True
    )
    print(f'{{"cdr": [\n{lines}\n],\n{rest.removeprefix("{")}')


if __name__ == "__main__":
    main()
