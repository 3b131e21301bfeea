#!/bin/sh
# A keyframe of a model that MjSpec attaches somewhere else puts the robot back where its own file had it.
#
# Setting: a robot with a free base at a height of 1 m and a keyframe "home" of that. Two of it are attached to a world
# by frames at x = 1 and x = 3; a cube lies at x = 5 and has been moved to x = 6 since. The world is reset to r1/home.
# Guess: the keyframe moves with its robot, as its bodies, cameras and sites do; and it says nothing of what is not in
# its file, so that the others stay.
# Seen, with mujoco 4.0.0 from the Python Package Index: the bodies begin at x = 1 and 3, but the keyframes of both have
# x = 0, the place in the child's file: at home, each robot is beside its frame. All else is put back to its beginning,
# the cube and the other robot included. Nothing warns of it.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco

ROBOT = """<mujoco model="robot"><worldbody><body name="base" pos="0 0 1"><freejoint/><geom size="0.1"/>
<body name="arm"><joint name="elbow" axis="0 1 0"/><geom size="0.05" pos="0.2 0 0"/></body></body></worldbody>
<keyframe><key name="home" qpos="0 0 1 1 0 0 0 0.5"/></keyframe></mujoco>"""
WORLD = """<mujoco><worldbody><body name="cube" pos="5 0 0"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
</worldbody></mujoco>"""

spec = mujoco.MjSpec.from_string(WORLD)
for prefix, x in (("r1/", 1), ("r2/", 3)):
    spec.attach(mujoco.MjSpec.from_string(ROBOT), prefix=prefix, frame=spec.worldbody.add_frame(pos=[x, 0, 0]))
model = spec.compile()
data = mujoco.MjData(model)


def places():
    mujoco.mj_forward(model, data)
    return ", ".join(f"{name} {data.body(name).xpos[0]:g}" for name in ("r1/base", "r2/base", "cube"))


with open(sys.argv[1] + "/seen", "w") as seen:
    print("begin:", places(), file=seen)
    data.qpos[0] = 6.0
    print("moved:", places(), file=seen)
    for name in ("r1/home", "r2/home"):
        mujoco.mj_resetDataKeyframe(model, data, model.key(name).id)
        print(f"{name}:", places(), file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
begin: r1/base 1, r2/base 3, cube 5
moved: r1/base 1, r2/base 3, cube 6
r1/home: r1/base 0, r2/base 3, cube 5
r2/home: r1/base 1, r2/base 0, cube 5
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
