"""A cart of the user's own: an MJCF, and the TOML file beside it."""

from __future__ import annotations

from typing import Final

__all__ = ["CART", "CART_TOML"]

CART: Final = """<mujoco>
  <worldbody>
    <geom type="plane" size="5 5 0.1"/>
    <body name="base" pos="0 0 0.05">
      <freejoint/>
      <geom type="cylinder" size="0.1 0.02" mass="2" contype="1" conaffinity="1"/>
      <geom type="sphere" size="0.02" pos="0.07 0 -0.03" mass="0.1" friction="0.02"/>
      <body name="left" pos="0 0.12 0">
        <joint name="left" axis="0 1 0"/><geom type="cylinder" size="0.05 0.01" quat="0.7071 0.7071 0 0" mass="0.1"/>
      </body>
      <body name="right" pos="0 -0.12 0">
        <joint name="right" axis="0 1 0"/><geom type="cylinder" size="0.05 0.01" quat="0.7071 0.7071 0 0" mass="0.1"/>
      </body>
      <body name="mast" pos="0.02 0 0.05">
        <joint name="pan" axis="0 0 1" pos="0.01 0 0" range="-1 1" limited="true" damping="0.02"/>
        <joint name="tilt" axis="0 1 0" pos="0.01 0 0.1" range="-0.5 0.5" limited="true"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.01" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="pan" joint="pan" kp="20" kv="1" forcerange="-3 3" forcelimited="true"/>
    <motor name="tilt" joint="tilt" ctrlrange="-2 2" ctrllimited="true"/>
    <velocity name="left" joint="left" kv="1" forcerange="-5 5" forcelimited="true"/>
    <velocity name="right" joint="right" kv="1" forcerange="-5 5" forcelimited="true"/>
  </actuator>
</mujoco>"""
"""A base on two wheels, with a head on a mast. Beside its TOML file as `cart.xml`."""
CART_TOML: Final = """
model = "cart.xml"
name = "Trolley"
[groups]
head = ["pan", "tilt"]
wheels = ["left", "right"]
[hinges.Neck]
pan = "pan"
tilt = { joint = "tilt", sign = -1 }
[walk]
kind = "wheels"
left = "left"
right = "right"
radius = 0.05
distance = 0.24
fastest = 0.4
fastest_turn = 2.0
[joint.left]
max_velocity = 12.0
[joint.right]
max_velocity = 12.0
"""
