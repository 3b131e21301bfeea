"""Judge where the head looks, by the angle to which it turns."""

SIDE = 0.3
"""rad from the middle from which on it is a side."""


def sides(run):
    """Return to which sides it looked: begin and end in s, and 1 for left, -1 for right."""
    found = []
    for moment in run.moments:
        pan = moment.head[0]
        side = 0 if abs(pan) < SIDE else 1 if pan > 0 else -1
        if found and found[-1][2] == side:
            found[-1][1] = moment.time
        else:
            found.append([moment.time, moment.time, side])
    return [each for each in found if each[2]]


def left_first(run):
    found = sides(run)
    if not found:
        return 0.0, {"en": "never turns the head to a side", "es": "no gira nunca la cabeza a un lado"}
    begin, _, side = found[0]
    if side < 0:
        return 0.0, {
            "en": f"looks to the right first, at {begin:.1f} s",
            "es": f"mira primero a la derecha, a los {begin:.1f} s",
        }
    good = begin <= 1.0
    return float(good), {
        "en": f"looks to the left after {begin:.1f} s; asked: within 1 s",
        "es": f"mira a la izquierda al cabo de {begin:.1f} s; se pide: en 1 s como máximo",
    }


def then_right(run):
    begin = next((begin for begin, _, side in sides(run) if side < 0), None)
    if begin is None:
        return 0.0, {"en": "never looks to the right", "es": "no mira nunca a la derecha"}
    return 1.0, {
        "en": f"looks to the right at {begin:.1f} s",
        "es": f"mira a la derecha a los {begin:.1f} s",
    }


def again_and_again(run):
    found = sides(run)
    turns = sum(before[2] != after[2] for before, after in zip(found, found[1:]))
    wanted = int(run.time / 3.0)
    return min(1.0, turns / wanted) if turns > 1 else 0.0, {
        "en": f"changes of side in {run.time:.0f} s: {turns}; asked: at least {wanted}",
        "es": f"cambios de lado en {run.time:.0f} s: {turns}; se pide: al menos {wanted}",
    }


def two_seconds(run):
    found = sides(run)[:-1]  # the last look is not over
    if not found:
        return 0.0, {"en": "does not change sides", "es": "no cambia de lado"}
    looks = [after[0] - before[0] for before, after in zip(found, sides(run)[1:])]
    worst = max(looks, key=lambda seconds: abs(seconds - 2.0))
    return float(abs(worst - 2.0) <= 0.5), {
        "en": f"looks to a side for {worst:.1f} s; asked: 2 s, and at most 0.5 s more or less",
        "es": f"mira a un lado {worst:.1f} s; se pide: 2 s, con 0.5 s de más o de menos",
    }
