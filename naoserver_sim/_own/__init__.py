"""A robot of the user: read from its model, an MJCF or URDF, and described as a body.

A file becomes a robot in six steps:

1. `tree` and `xacro` read its XML into an `Element`, each with its file and line.
2. `urdf` or `mjcf` refuse what no robot has, and repair in the tree what MuJoCo refuses and robots have;
   `meshes` finds the files that it names.
3. `model_file` lets MuJoCo read that, without what it refuses beside a robot: a `ModelFile`.
4. `parts` makes tables of links, joints, servos and shapes of it, with `figure` and `couplings`: `Parts`.
5. Of a model alone, `guesses` adds what the parts are for, with `limbs`: the TOML file, which `toml_text`
   writes.
6. `_own_body`, beside this folder, makes a `Body` of both, and `looks` what is seen of it.

A repair, an omission and a guess are a sentence each, in `notes` or in `Guesses`. A refusal is a `RobotError`
with file and line: of a tree, those that the generators `_faults` yield, which `tree.refuse` raises.
"""
