"""What counts in the trials of get_up.xml, by where the torso really is: whether it stands, and how it fell."""

import math

LEAN = 0.2
"""Most that the torso of a robot that stands may lean, in rad."""
LOW = 0.28
"""Least height of the torso of a Nao that stands, in m: 0.33 in the posture Stand."""


def stands(run):
    """Return why it does not stand, empty if it does."""
    torso = run.robot.device.stage.truth().torso
    _, x, y, _ = torso.orientation
    lean, height = math.acos(1.0 - 2.0 * (x * x + y * y)), torso.position[2]
    return "" if lean < LEAN and height > LOW else f"leans by {lean:.2f} rad, its torso at {height:.2f} m"


def lay(run):
    """Return what it lay on when it got up last: belly, back, left side or right side."""
    return run.variables("get_up")["lay"] or "did not fall"


def seconds(run):
    """Return how long it took from the fall until it stood, not a number if it did not fall."""
    falls = [time for time, state in run.changes("get_up") if state == "fallen"]
    return run.time - falls[0] if falls else math.nan
