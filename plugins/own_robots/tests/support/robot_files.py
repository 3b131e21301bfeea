"""Pieces of a URDF that a test writes itself, a line for each element that may be at fault."""

from __future__ import annotations

from typing import Final

__all__ = ["BOX", "INERTIAL", "joint", "link", "urdf"]

INERTIAL: Final = (
    '<inertial><origin xyz="0 0 0.1"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>'
)
BOX: Final = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'


def link(name: str, shapes: str = BOX, inertial: str = INERTIAL) -> str:
    """Return a link, in one line."""
    return f'  <link name="{name}">{inertial}{shapes}</link>\n'


def joint(name: str, parent: str, child: str, more: str = "", kind: str = "revolute") -> str:
    """Return a joint, in three lines, the last of which has its limits."""
    return (
        f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>\n'
        f'    <origin xyz="0 0 0.2" rpy="0 0 0"/><axis xyz="0 1 0"/>\n'
        f'    <limit lower="-1" upper="1" effort="5" velocity="2"/>{more}</joint>\n'
    )


def urdf(*parts: str) -> str:
    """Return a robot, whose first part is in line 2."""
    return '<robot name="arm">\n' + "".join(parts) + "</robot>\n"
