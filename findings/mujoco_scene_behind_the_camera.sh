#!/bin/sh
# The scene that MuJoCo draws for a camera holds every geom of the model, also those behind it and those far aside.
#
# Setting: a fixed camera, forty spheres before it, and one behind; the camera then looks the other way, and up.
# Guess: a scene is made for a camera, so that what is outside of its view is left out, as game engines do.
# Seen, with mujoco 4.0.0 from the Python Package Index: mjv_updateScene lists all 41 each time. Where the processor
# draws, they cost: of the 14.5 ms of a picture with four humanoids in the world, 5 to 10 were for what it did not show.
# Who wants geoms left out does so in the model: by a group that the options do not show.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile mujoco==4.0.0
cat >"$folder/tried.py" <<'PYTHON'
import sys

import mujoco

BEFORE = "".join(f'<geom size="0.05" pos="{3 + 0.2 * (n % 8)} {0.2 * (n // 8)} 0"/>' for n in range(40))
MODEL = f"""<mujoco><worldbody>{BEFORE}<geom size="0.05" pos="-3 0 0"/>
<camera name="toward" xyaxes="0 -1 0 0 0 1"/><camera name="away" xyaxes="0 1 0 0 0 1"/>
<camera name="up" xyaxes="1 0 0 0 -1 0"/></worldbody></mujoco>"""

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
scene, options, view = mujoco.MjvScene(model, 100), mujoco.MjvOption(), mujoco.MjvCamera()
view.type = mujoco.mjtCamera.mjCAMERA_FIXED

with open(sys.argv[1] + "/seen", "w") as seen:
    for hidden in (False, True):
        model.geom_group[:40] = 5 if hidden else 0
        for name in ("toward", "away", "up"):
            view.fixedcamid = model.camera(name).id
            everything = mujoco.mjtCatBit.mjCAT_ALL
            mujoco.mjv_updateScene(model, data, options, mujoco.MjvPerturb(), view, everything, scene)
            print(f"{name}, {'forty in group 5' if hidden else 'all in group 0'}: {scene.ngeom} geoms", file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
toward, all in group 0: 41 geoms
away, all in group 0: 41 geoms
up, all in group 0: 41 geoms
toward, forty in group 5: 1 geoms
away, forty in group 5: 1 geoms
up, forty in group 5: 1 geoms
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
