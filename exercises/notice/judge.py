"""Judge what the robot does before its camera freezes, meanwhile and afterwards, by where it really is."""

import math

STILL = 0.002
"""m between two moments, a tenth of a second apart, up to which it stands."""
IN_TIME = 2.0
"""s in which it must notice."""
NEAR = 0.15
"""rad between head and ball up to which it looks at the ball."""


def frozen(run):
    """Return from when to when the camera is frozen, in s."""
    begin = run.events["freezes"]
    return begin, begin + run.values["freezes.seconds"]


def steps(run, begin, end):
    """Return how far it walks from each moment to the next, between two times: begin in s, and m."""
    return [
        (before.time, math.dist(before.place, after.place))
        for before, after in zip(run.moments, run.moments[1:])
        if before.time >= begin and after.time <= end
    ]


def walked(run, begin, end):
    """Return how far it walks between two times in m."""
    return sum(way for _, way in steps(run, begin, end))


def stop(run):
    """Return when it stands after the camera froze, in s, or None if it walks on, or did not walk before."""
    begin, end = frozen(run)
    if walked(run, 0.0, begin) < 0.1:
        return None
    times = [time for time, way in steps(run, begin, end) if way <= STILL]
    return times[0] if times else None


def follows(run):
    begin, _ = frozen(run)
    there = [moment for moment in run.moments if begin - 1.0 <= moment.time <= begin]
    off = max(abs(moment.head[0] - run.values["carried.pan"]) for moment in there)
    return float(off <= NEAR), {
        "en": f"looks past the ball by up to {off:.2f} rad; asked: at most {NEAR} rad",
        "es": f"mira hasta {off:.2f} rad al lado del balón; se pide: {NEAR} rad como máximo",
    }


def walks(run):
    begin, _ = frozen(run)
    stood = sum(0.1 for _, way in steps(run, 0.0, begin) if way <= STILL)
    return float(stood <= 0.5), {
        "en": f"stands for {stood:.1f} s while it sees the ball; asked: at most 0.5 s",
        "es": f"está parado {stood:.1f} s mientras ve el balón; se pide: 0.5 s como máximo",
    }


def stops(run):
    begin, end = frozen(run)
    if walked(run, 0.0, begin) < 0.1:
        return 0.0, {"en": "does not walk before", "es": "no anda antes"}
    time = stop(run)
    if time is None:
        far = walked(run, begin, end)
        return 0.0, {
            "en": f"walks on for {far:.2f} m while its camera is frozen",
            "es": f"sigue andando {far:.2f} m con la cámara congelada",
        }
    return float(time - begin <= IN_TIME), {
        "en": f"stands {time - begin:.1f} s after the camera freezes; asked: within {IN_TIME:.0f} s",
        "es": f"se para {time - begin:.1f} s después de congelarse la cámara; se pide: en {IN_TIME:.0f} s como máximo",
    }


def says_so(run):
    begin, end = frozen(run)
    said = [call.time for call in run.calls("Speech.say") if call.error is None and call.text.strip()]
    meanwhile = [time for time in said if begin <= time <= end]
    if len(meanwhile) > 1:
        return 0.0, {
            "en": f"says something {len(meanwhile)} times while its camera is frozen; asked: once",
            "es": f"dice algo {len(meanwhile)} veces con la cámara congelada; se pide: una vez",
        }
    if not meanwhile and said and said[0] < begin:
        return 0.0, {
            "en": f"says something at {said[0]:.1f} s, while it sees the ball, and nothing when the camera freezes",
            "es": f"dice algo a los {said[0]:.1f} s, mientras ve el balón, y nada cuando se congela la cámara",
        }
    if not meanwhile:
        return 0.0, {"en": "says nothing", "es": "no dice nada"}
    late = meanwhile[0] - begin
    return float(late <= IN_TIME), {
        "en": f"says so {late:.1f} s after the camera freezes; asked: within {IN_TIME:.0f} s",
        "es": f"lo dice {late:.1f} s después de congelarse la cámara; se pide: en {IN_TIME:.0f} s como máximo",
    }


def stands(run):
    _, end = frozen(run)
    time = stop(run)
    if time is None:
        return 0.0, {"en": "does not stop a walk", "es": "no deja de andar"}
    far = walked(run, time, end)
    return float(far <= 0.02), {
        "en": f"walks {far:.2f} m after it stopped, and still sees nothing; asked: nothing",
        "es": f"anda {far:.2f} m después de pararse, cuando aún no ve nada; se pide: nada",
    }


def goes_on(run):
    _, end = frozen(run)
    if stop(run) is None:
        return 0.0, {"en": "does not stop a walk", "es": "no deja de andar"}
    again = [time for time, way in steps(run, end, run.time) if way > STILL]
    if not again:
        return 0.0, {
            "en": "stands for good, though the camera works again",
            "es": "se queda parado para siempre, aunque la cámara vuelve a funcionar",
        }
    late = again[0] - end
    after = [moment for moment in run.moments if end <= moment.time <= end + IN_TIME]
    off = min(abs(moment.head[0] - run.values["unseen.pan"]) for moment in after)
    return float(late <= IN_TIME and off <= NEAR), {
        "en": f"walks {late:.1f} s after the camera works again, and looks past the ball by {off:.2f} rad; "
        f"asked: within {IN_TIME:.0f} s, and at most {NEAR} rad",
        "es": f"anda {late:.1f} s después de que la cámara vuelva a funcionar, y mira {off:.2f} rad al lado del balón; "
        f"se pide: en {IN_TIME:.0f} s como máximo, y {NEAR} rad",
    }
