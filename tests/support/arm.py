"""An arm of the user's own: a URDF, and the TOML file beside it."""

from __future__ import annotations

from typing import Final

__all__ = ["ARM", "ARM_TOML"]

_INERTIAL: Final = """
    <inertial><origin xyz="0 0 0.1"/><mass value="1"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>"""
ARM: Final = f"""<robot name="arm">
  <link name="base">{_INERTIAL}
    <collision><origin xyz="0 0 0.05"/><geometry><box size="0.2 0.2 0.1"/></geometry></collision></link>
  <link name="upper">{_INERTIAL}
    <collision><origin xyz="0 0 0.12"/><geometry><cylinder radius="0.03" length="0.16"/></geometry></collision></link>
  <link name="hand">{_INERTIAL}
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.04 0.04 0.1"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <origin xyz="0 0 0.12"/><limit effort="20" velocity="2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="hand"/><axis xyz="0 1 0"/>
    <origin xyz="0 0 0.24" rpy="1.2 0 0"/><limit lower="-2" upper="2" effort="15" velocity="2.5"/></joint>
</robot>
"""
"""An arm on a table: a joint that turns without end, and an elbow. Beside its TOML file as `arm.urdf`."""
ARM_TOML: Final = """title = "An arm"
model = "arm.urdf"
mounted = true
"""
