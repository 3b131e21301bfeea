"""Models of robots in tests/data/models, and pieces of such a URDF."""

from __future__ import annotations

from typing import Final

from tests.support.places import DATA

FOLDER: Final = DATA / "models"
_TURNS: Final = 'lower="-1.5" upper="1.5"'


def link(name: str, mass: float = 1.0, shape: str = "", at: str = "0 0 0", rpy: str = "0 0 0") -> str:
    """Return a link whose mass, and shape if it has one, is at a place; without a mass, a mere frame."""
    origin = f'<origin xyz="{at}" rpy="{rpy}"/>'
    touched = f"<collision>{origin}<geometry>{shape}</geometry></collision>" if shape else ""
    moment = f"{0.005 * mass:g}"
    inertia = f'<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/>'
    weight = f'<inertial><origin xyz="{at}"/><mass value="{mass}"/>{inertia}</inertial>' if mass else ""
    return f'<link name="{name}">{weight}{touched}</link>\n'


def joint(  # noqa: PLR0917 - the order in a URDF
    name: str,
    parent: str,
    child: str,
    at: str = "0 0 0",
    axis: str = "0 0 1",
    limit: str = _TURNS,
    kind: str = "revolute",
    more: str = "",
    rpy: str = "0 0 0",
) -> str:
    """Return a joint."""
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{at}" rpy="{rpy}"/>'
    limits = f"<limit {limit}/>" if limit else ""
    return f'<joint name="{name}" type="{kind}">{ends}<axis xyz="{axis}"/>{limits}{more}</joint>\n'


def fixed(parent: str, child: str, at: str = "0 0 0") -> str:
    """Return what fixes a link to another one."""
    return joint(f"{child}_fixed", parent, child, at, limit="", kind="fixed")


def robot(*parts: str) -> str:
    """Return a URDF."""
    return f'<robot name="robot">\n{"".join(parts)}</robot>\n'


MODELS: Final = {
    name: (FOLDER / f"{name}.urdf").read_text("utf-8")
    for name in ("gripper_arm", "humanoid", "quadruped", "carrier", "rotors", "head", "rail")
}
"""Small robots of each kind, in whose URDF nothing is said that can be guessed."""
