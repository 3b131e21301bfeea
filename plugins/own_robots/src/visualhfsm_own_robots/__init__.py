"""Robots of one's own, from their models: a URDF, xacro or MJCF becomes a body.

A file becomes a robot in six steps:

1. `_tree` and `_xacro` read its XML into an `Element`, each with its file and line.
2. `_urdf` or `_mjcf` refuse what no robot has, and repair in the tree what MuJoCo refuses and robots have;
   `_meshes` finds the files that it names.
3. `_model_file` lets MuJoCo read that, without what it refuses beside a robot: a `ModelFile`.
4. `_parts` makes tables of links, joints, servos and shapes of it, with `_figure` and `_couplings`: `Parts`.
5. Of a model alone, `_guesses` adds what the parts are for, with `_limbs`: the TOML file, which `_toml_text`
   writes.
6. `_body` makes a `Body` of both, and `_looks` what is seen of it.

A repair, an omission and a guess are a sentence each, in `notes` or in `Guesses`. A refusal is a `RobotError`
with file and line: of a tree, those that the generators `_faults` yield, which `_tree.refuse` raises.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from visualhfsm_own_robots._body import read_own_body as read_own_body
    from visualhfsm_own_robots._body import write_own_body as write_own_body

# The process that expands xacro needs none of them.
__getattr__, __dir__ = import_on_use(__name__)
