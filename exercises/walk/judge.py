"""Judge where the robot walks, by where it really is: in the frame in which it started."""

import cmath
import math

FAR = 0.5
"""m ahead that are asked."""


def way(run):
    """Return where it was ten times a second, x ahead and y to the left in m as a complex number."""
    start = run.moments[0]
    facing = cmath.rect(1.0, start.heading)
    return [(complex(*moment.place) - complex(*start.place)) / facing for moment in run.moments]


def goes_ahead(run):
    far = max(place.real for place in way(run))
    return float(abs(far - FAR) <= 0.15), {
        "en": f"walks {far:.2f} m ahead; asked: {FAR} m, and at most 0.15 m more or less",
        "es": f"anda {far:.2f} m hacia delante; se pide: {FAR} m, con 0.15 m de más o de menos",
    }


def comes_back(run):
    places = way(run)
    if max(place.real for place in places) < FAR / 2:
        return 0.0, {"en": "never was away", "es": "no se ha ido"}
    off = abs(places[-1])
    return float(off <= 0.2), {
        "en": f"ends {off:.2f} m away from where it started; asked: at most 0.2 m",
        "es": f"acaba a {off:.2f} m de donde salió; se pide: 0.2 m como máximo",
    }


def turned(run):
    angle = abs(math.remainder(run.moments[-1].heading - run.moments[0].heading, math.tau))
    return float(angle >= math.pi - 0.35), {
        "en": f"has turned by {math.degrees(angle):.0f} degrees; asked: 180, and at most 20 less",
        "es": f"ha girado {math.degrees(angle):.0f} grados; se pide: 180, o como mucho 20 menos",
    }


def upright(run):
    if run.fell is None:
        moved = max(abs(place) for place in way(run))
        return float(moved > 0.1), {
            "en": f"does not fall, and moves {moved:.2f} m",
            "es": f"no se cae, y se mueve {moved:.2f} m",
        }
    return 0.0, {"en": f"falls after {run.fell:.1f} s", "es": f"se cae a los {run.fell:.1f} s"}
