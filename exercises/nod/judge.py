"""Judge nods by the tilt of the head, which is positive downwards."""

DOWN, UP = 0.25, 0.1  # rad


def nods(run):
    count, is_down = 0, False
    for moment in run.moments:
        tilt = moment.head[1]
        if not is_down and tilt > DOWN:
            count += 1
        is_down = tilt > (UP if is_down else DOWN)
    wanted = run.values["parameters.times"]
    return float(count == wanted), {
        "en": f"number of nods: {count}; asked: {wanted}",
        "es": f"veces que dice que sí: {count}; se pide: {wanted}",
    }


def still(run):
    since = run.entered("done")
    if since is None or run.time - since < 1.5:
        return 0.0, {"en": "is not in `done` for 1 s", "es": "no está 1 s en `done`"}
    after = [moment.head for moment in run.moments if moment.time > since + 1.0]
    off = max(max(abs(pan), abs(tilt)) for pan, tilt in after)
    return float(off < 0.1), {
        "en": f"in `done` the head is up to {off:.2f} rad away from straight ahead; asked: at most 0.1 rad",
        "es": f"en `done` la cabeza se aparta hasta {off:.2f} rad del frente; se pide: 0.1 rad como máximo",
    }
