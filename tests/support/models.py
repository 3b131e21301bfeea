"""Small models of robots of each kind, as URDF, in which nothing is said that can be guessed."""

from __future__ import annotations

from typing import Final

__all__ = [
    "ARM",
    "CARRIER",
    "HEAD",
    "HUMANOID",
    "MODELS",
    "QUADRUPED",
    "RAIL",
    "ROTORS",
    "joint",
    "link",
    "robot",
]

_ROD: Final = '<cylinder radius="0.04" length="0.3"/>'
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


def _arm() -> str:
    """Return an arm that has no mount, with a gripper of which one finger follows the other."""
    parts = [link("base_link", 2.0, '<cylinder radius="0.06" length="0.1"/>', "0 0 0.05")]
    before, up = "base_link", 0.1
    chain = (("pan", "0 0 1"), ("lift", "0 1 0"), ("bend", "0 1 0"), ("wrist", "0 0 1"))
    for number, (name, axis) in enumerate(chain):
        parts += [link(name, 1.5 / (number + 1), _ROD, "0 0 0.15")]
        parts += [joint(f"{name}_joint", before, name, f"0 0 {up}", axis)]
        before, up = name, 0.3
    for side, y in (("left", 1), ("right", -1)):
        finger = f"{side}_finger"
        mimic = '<mimic joint="left_finger_joint"/>' if side == "right" else ""
        limit = 'lower="0" upper="0.03" effort="10" velocity="0.1"'
        parts += [link(finger, 0.02, '<box size="0.01 0.01 0.06"/>', "0 0 0.03")]
        parts += [
            joint(
                f"{finger}_joint", before, finger, f"0 {0.02 * y} 0.32", f"0 {y} 0", limit, "prismatic", mimic
            )
        ]
    return robot(*parts)


def _humanoid() -> str:
    """Return a humanoid with a waist, whose head tilts up at positive angles."""
    ball, foot = '<sphere radius="0.04"/>', '<box size="0.2 0.09 0.03"/>'
    parts = [
        link("pelvis", 5.0, '<box size="0.15 0.2 0.1"/>'),
        link("torso", 8.0, '<box size="0.18 0.25 0.4"/>', "0 0 0.22"),
        joint("waist", "pelvis", "torso", "0 0 0.06"),
        link("neck", 0.3, '<cylinder radius="0.04" length="0.06"/>', "0 0 0.03"),
        joint("head_pan", "torso", "neck", "0 0 0.43"),
        link("head", 1.5, '<sphere radius="0.1"/>', "0 0 0.1"),
        joint("head_tilt", "neck", "head", "0 0 0.07", "0 -1 0"),
        link("camera_link", 0.0),
        fixed("head", "camera_link", "0.1 0 0.1"),
        link("imu_link", 0.0),
        fixed("pelvis", "imu_link", "0.02 0 0.03"),
    ]
    for side, y in (("l", 1), ("r", -1)):
        for name, carrier, at, axis, shape, middle, mass in (
            ("shoulder_pitch", "torso", f"0 {0.16 * y} 0.35", "0 1 0", ball, "0 0 0", 0.5),
            ("shoulder_roll", "shoulder_pitch", f"0 {0.05 * y} 0", "1 0 0", _ROD, "0 0 -0.16", 1.0),
            ("elbow", "shoulder_roll", "0 0 -0.35", "0 1 0", _ROD, "0 0 -0.16", 0.8),
            ("hip_yaw", "pelvis", f"0 {0.08 * y} -0.05", "0 0 1", ball, "0 0 0", 0.5),
            ("hip_roll", "hip_yaw", "0 0 -0.04", "1 0 0", ball, "0 0 0", 0.5),
            ("hip_pitch", "hip_roll", "0 0 -0.04", "0 1 0", _ROD, "0 0 -0.18", 2.5),
            ("knee", "hip_pitch", "0 0 -0.36", "0 1 0", _ROD, "0 0 -0.18", 1.5),
            ("ankle_pitch", "knee", "0 0 -0.36", "0 1 0", ball, "0 0 0", 0.2),
            ("ankle_roll", "ankle_pitch", "0 0 0", "1 0 0", foot, "0.03 0 -0.05", 0.6),
        ):
            on = carrier if carrier in ("torso", "pelvis") else f"{side}_{carrier}_link"
            child = f"{side}_{name}_link"
            parts += [link(child, mass, shape, middle), joint(f"{side}_{name}", on, child, at, axis)]
    return robot(*parts)


def _quadruped() -> str:
    """Return a robot on four legs, whose knees are always bent."""
    parts = [link("trunk", 8.0, '<box size="0.4 0.2 0.1"/>')]
    for leg, x, y in (("FL", 1, 1), ("FR", 1, -1), ("RL", -1, 1), ("RR", -1, -1)):
        parts += [
            link(f"{leg}_hip", 0.6, '<sphere radius="0.04"/>'),
            joint(f"{leg}_hip_joint", "trunk", f"{leg}_hip", f"{0.2 * x} {0.06 * y} 0", "1 0 0"),
            link(f"{leg}_thigh", 1.0, '<box size="0.03 0.03 0.2"/>', "0 0 -0.1"),
            joint(f"{leg}_thigh_joint", f"{leg}_hip", f"{leg}_thigh", f"0 {0.08 * y} 0", "0 1 0"),
            link(f"{leg}_calf", 0.2, '<box size="0.02 0.02 0.18"/>', "0 0 -0.1"),
            joint(
                f"{leg}_calf_joint",
                f"{leg}_thigh",
                f"{leg}_calf",
                "0 0 -0.2",
                "0 1 0",
                'lower="-2.7" upper="-0.9"',
            ),
            link(f"{leg}_foot", 0.06, '<sphere radius="0.02"/>'),
            fixed(f"{leg}_calf", f"{leg}_foot", "0 0 -0.2"),
        ]
    return robot(*parts)


def _carrier() -> str:
    """Return a cart on two wheels and a ball, whose right wheel drives forwards at negative angles."""
    parts = [
        link("base_footprint", 0.0),
        link("base_link", 3.0, '<cylinder radius="0.15" length="0.06"/>', "0 0 0.05"),
        fixed("base_footprint", "base_link", "0 0 0.01"),
        link("caster", 0.1, '<sphere radius="0.015"/>'),
        fixed("base_link", "caster", "-0.1 0 0.005"),
    ]
    for side, y in (("left", 1), ("right", -1)):
        wheel = f"{side}_wheel"
        parts += [
            link(wheel, 0.2, '<cylinder radius="0.04" length="0.02"/>'),
            joint(
                f"{wheel}_joint", "base_link", wheel, f"0 {0.12 * y} 0.03", f"0 0 {y}", "", "continuous",
                rpy="-1.5708 0 0",
            ),
        ]  # fmt: skip
    return robot(*parts)


def _rotors() -> str:
    """Return a drone."""
    parts = [link("body", 1.0, '<box size="0.2 0.2 0.06"/>')]
    for number, (x, y) in enumerate(((1, 1), (1, -1), (-1, 1), (-1, -1))):
        parts += [link(f"rotor{number}", 0.01, '<cylinder radius="0.06" length="0.005"/>')]
        at = f"{0.13 * x} {0.13 * y} 0.05"
        parts += [joint(f"rotor{number}_joint", "body", f"rotor{number}", at, limit="", kind="continuous")]
    return robot(*parts)


ARM: Final = _arm()
HUMANOID: Final = _humanoid()
QUADRUPED: Final = _quadruped()
CARRIER: Final = _carrier()
ROTORS: Final = _rotors()
HEAD: Final = robot(
    link("base", 0.5, '<box size="0.1 0.1 0.05"/>', "0 0 0.025"),
    link("turntable", 0.1, '<cylinder radius="0.02" length="0.05"/>', "0 0 0.025"),
    joint("pan_joint", "base", "turntable", "0 0 0.05"),
    link("camera", 0.1, '<box size="0.03 0.05 0.03"/>'),
    joint("tilt_joint", "turntable", "camera", "0 0 0.07", "0 1 0"),
)
"""A camera that pans and tilts on a foot."""
RAIL: Final = robot(
    link("world", 0.0),
    link("rail", 2.0, '<box size="1 0.05 0.05"/>'),
    fixed("world", "rail", "0 0 1"),
    link("slider", 1.0, '<box size="0.1 0.1 0.1"/>', "0 0 0.08"),
    joint("slide", "rail", "slider", "0 0 0", "1 0 0", 'lower="-0.45" upper="0.45" effort="0"', "prismatic"),
    link("pole", 0.2, '<cylinder radius="0.01" length="0.4"/>', "0 0 -0.2"),
    joint("passive_hinge", "slider", "pole", "0 0.06 0", "0 1 0", "", "continuous"),
)
"""A slider on a rail, with a pole that hangs from it by a hinge without a motor."""
MODELS: Final = {
    "arm": ARM,
    "humanoid": HUMANOID,
    "quadruped": QUADRUPED,
    "carrier": CARRIER,
    "rotors": ROTORS,
    "head": HEAD,
    "rail": RAIL,
}
