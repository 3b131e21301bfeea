#!/bin/sh
# Gymnasium does not find the environments that an installed package names by an entry point, and says nothing.
#
# Setting: a package names a function that registers an environment in the group of entry points `gymnasium.envs`, as
# packages did for Gym and for the first versions of Gymnasium; a program calls gymnasium.make without importing it.
# Guess: the environment is made, since the package was installed for that; or a warning names the group.
# Seen, with gymnasium 1.4.0 from the Python Package Index (envs/registration.py): the group is not read. make raises
# that the environment does not exist, with no word of the package. By `module:Name`, which imports the module, the same
# environment is made.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile gymnasium==1.4.0 numpy==1.26.4
mkdir -p "$folder/there/robot_envs-1.0.dist-info"
printf 'Metadata-Version: 2.1\nName: robot-envs\nVersion: 1.0\n' >"$folder/there/robot_envs-1.0.dist-info/METADATA"
cat >"$folder/there/robot_envs-1.0.dist-info/entry_points.txt" <<'POINTS'
[gymnasium.envs]
__root__ = robot_envs:register_all
POINTS
cat >"$folder/there/robot_envs.py" <<'PYTHON'
from gymnasium.envs.registration import register, registry  # there while gymnasium itself is being imported


def register_all():
    if "Stand-v0" not in registry:
        register("Stand-v0", entry_point="robot_stand:Stand")


register_all()
PYTHON
cat >"$folder/there/robot_stand.py" <<'PYTHON'
import gymnasium


class Stand(gymnasium.Env):
    observation_space = action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return 0, {}

    def step(self, action):
        return 0, 0.0, True, False, {}
PYTHON
cat >"$folder/tried.py" <<'PYTHON'
import gymnasium


def outcome(name):
    try:
        gymnasium.make(name).close()
    except gymnasium.error.Error as error:
        return type(error).__name__
    return "made"


for name in ("Stand-v0", "robot_envs:Stand-v0"):
    print(name, outcome(name))
PYTHON
cat >"$folder/expected" <<'EXPECTED'
Stand-v0 NameNotFound
robot_envs:Stand-v0 made
EXPECTED
PYTHONPATH="$folder/there" "$folder/venv/bin/python" "$folder/tried.py" >"$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
