"""The robot's skin: a white shell with dark joints and orange panels, drawn by our own hand.

Shapes are given for the left side, in m in the links' frames: x forward, y left, z up; of the arms, which
point forward when all joints are 0, x is along the limb.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from naoserver_sim.appearance import Material, Painter
from naoserver_sim.mesh import Section, band, loft, panel

_SKULL: Final = (
    Section(-0.004, (0.035, 0.038), (0.000, 0), 2.3),
    Section(0.012, (0.048, 0.051), (-0.001, 0), 2.4),
    Section(0.034, (0.0575, 0.0600), (-0.003, 0), 2.35),
    Section(0.056, (0.0615, 0.0635), (-0.004, 0), 2.3),
    Section(0.078, (0.0580, 0.0600), (-0.005, 0), 2.3),
    Section(0.095, (0.0470, 0.0490), (-0.006, 0), 2.2),
    Section(0.106, (0.0330, 0.0345), (-0.006, 0), 2.1),
    Section(0.1115, (0.0190, 0.0195), (-0.006, 0), 2.0),
)
_TRUNK: Final = (
    Section(-0.094, (0.026, 0.034), (-0.010, 0), 2.4),
    Section(-0.070, (0.038, 0.043), (-0.008, 0), 2.6),
    Section(-0.035, (0.043, 0.049), (-0.006, 0), 2.7),
    Section(0.000, (0.045, 0.053), (-0.004, 0), 2.7),
    Section(0.034, (0.050, 0.061), (-0.002, 0), 2.8),
    Section(0.066, (0.053, 0.068), (-0.003, 0), 2.8),
    Section(0.094, (0.048, 0.064), (-0.005, 0), 2.7),
    Section(0.110, (0.036, 0.048), (-0.006, 0), 2.5),
)
_UPPER_ARM: Final = (
    Section(-0.024, (0.026, 0.032), (0.004, 0), 2.2),
    Section(0.000, (0.034, 0.038), (0.005, 0), 2.3),
    Section(0.024, (0.032, 0.034), (0.007, 0), 2.3),
    Section(0.044, (0.025, 0.026), (0.010, 0), 2.2),
    Section(0.082, (0.0225, 0.0235), (0.014, 0), 2.1),
)
_FOREARM: Final = (
    Section(0.002, (0.024, 0.025), squareness=2.2),
    Section(0.022, (0.031, 0.031), squareness=2.4),
    Section(0.046, (0.028, 0.028), squareness=2.4),
)
_THIGH: Final = (
    Section(-0.090, (0.031, 0.032), (0.003, 0.003), 2.4),
    Section(-0.066, (0.040, 0.039), (0.005, 0.005), 2.6),
    Section(-0.036, (0.046, 0.044), (0.005, 0.007), 2.7),
    Section(-0.008, (0.044, 0.042), (0.002, 0.006), 2.6),
    Section(0.014, (0.034, 0.033), (-0.002, 0.004), 2.4),
)
_SHIN: Final = (
    Section(-0.092, (0.032, 0.034), (-0.001, 0.003), 2.4),
    Section(-0.070, (0.042, 0.040), (-0.003, 0.004), 2.6),
    Section(-0.040, (0.045, 0.043), (-0.003, 0.004), 2.6),
    Section(-0.014, (0.037, 0.037), (0.001, 0.003), 2.4),
)
_FOOT: Final = (
    Section(-0.0440, (0.0750, 0.0440), (0.0245, 0.0055), 2.9),
    Section(-0.0330, (0.0755, 0.0448), (0.0245, 0.0055), 2.8),
    Section(-0.0200, (0.0650, 0.0410), (0.0180, 0.0048), 2.6),
    Section(-0.0060, (0.0450, 0.0360), (0.0040, 0.0030), 2.4),
    Section(0.0060, (0.0350, 0.0320), (-0.0020, 0.0020), 2.3),
)


def paint_skin(paint: Painter) -> None:
    """Show the skin."""
    _paint_head(paint)
    _paint_torso(paint)
    _paint_arms(paint)
    _paint_legs(paint)


def _paint_plate(
    paint: Painter,
    link: str,
    sections: Sequence[Section],
    *,
    at: tuple[float, float],
    reach: float,
    taper: float,
    roundness: float,
) -> None:
    """Show a white plate in front of a white shell, with a dark gap round it; `reach` in degrees."""
    for gap, turn, lift, material in (
        (0.002, 3.5, 0.0004, Material.GREY),
        (0.000, 0.0, 0.0011, Material.WHITE),
    ):
        plate = panel(
            sections,
            at=(at[0] - gap, at[1] + gap),
            angle=(-reach - turn, reach + turn),
            taper=taper,
            lift=lift,
            roundness=roundness,
            grid=(11, 13),
        )
        paint.shell(link, plate, material)


def _paint_head(paint: Painter) -> None:
    paint.shell("head", loft(_SKULL, domes=(0.008, 0.0025), slices=28), Material.WHITE)
    _paint_plate(paint, "head", _SKULL, at=(0.003, 0.086), reach=70.5, taper=0.12, roundness=3.2)
    eye, outward = (0.0516, 0.0284, 0.0505), (0.86, 0.50, 0.06)
    paint.disc("head", (0.0196, 0.0050), eye, outward, Material.GREY, twice=True)
    paint.lamp("head", (0.0170, 0.0075), eye, outward, "Eye", twice=True)
    paint.disc("head", (0.0125, 0.0095), eye, outward, Material.BLACK, twice=True)
    for place, ahead, radius in (
        ((0.0570, 0, 0.0640), (0.99, 0, 0.12), 0.0058),
        ((0.0490, 0, 0.0177), (0.86, 0, -0.50), 0.0066),
    ):
        paint.disc("head", (radius, 0.0044), place, ahead, Material.BLACK)
    ear = (-0.003, 0.0600, 0.0520)
    paint.disc("head", (0.0345, 0.0080), ear, (0, 1, 0), Material.LIGHT_GREY, twice=True)
    paint.disc("head", (0.0310, 0.0130), ear, (0, 1, 0), Material.ORANGE, twice=True)
    paint.disc("head", (0.0255, 0.0155), ear, (0, 1, 0), Material.WHITE, twice=True)
    paint.lamp("head", (0.0205, 0.0170), ear, (0, 1, 0), "Ear", twice=True)
    paint.disc("head", (0.0180, 0.0180), ear, (0, 1, 0), Material.GREY, twice=True)
    for x, z, length in ((0.023, 0.1075, 0.013), (-0.004, 0.1130, 0.012), (-0.031, 0.1085, 0.013)):
        paint.ellipsoid("head", (length, 0.0125, 0.0036), (x, 0, z), Material.DARK)
    paint.lamp("head", (0.0050, 0.0014), (-0.004, 0, 0.1165), (0, 0, 1), "Head")
    paint.disc("neck", (0.024, 0.036), (0, 0, -0.016), (0, 0, 1), Material.DARK)


def _paint_torso(paint: Painter) -> None:
    paint.shell("torso", loft(_TRUNK, domes=(0.010, 0.008), slices=28), Material.WHITE)
    # Between chest and belly, and between the chest's front and back, the shell has gaps.
    paint.shell("torso", band(_TRUNK, at=(0.0165, 0.0190), lift=0.0006, slices=28), Material.GREY)
    for side in ((32.0, 112.0), (-112.0, -32.0)):
        flank = panel(_TRUNK, at=(-0.062, 0.012), angle=side, taper=0.12, lift=0.0012, roundness=4.5)
        paint.shell("torso", flank, Material.ORANGE)
    battery = panel(_TRUNK, at=(0.030, 0.100), angle=(138, 222), lift=0.0010, roundness=5.0)
    paint.shell("torso", battery, Material.LIGHT_GREY)
    button = (0.0500, 0, 0.0552)
    paint.disc("torso", (0.0135, 0.0050), button, (1, 0, 0.05), Material.GREY)
    paint.disc("torso", (0.0115, 0.0070), button, (1, 0, 0.05), Material.LIGHT_GREY)
    paint.lamp("torso", (0.0085, 0.0085), button, (1, 0, 0.05), "Chest")
    for z, x in ((0.072, 0.0458), (0.040, 0.0455)):
        paint.disc("torso", (0.0090, 0.0070), (x, 0.0360, z), (0.96, 0.28, 0), Material.GREY, twice=True)
    paint.disc("torso", (0.030, 0.010), (-0.004, 0, 0.1130), (0, 0, 1), Material.DARK)


def _paint_arms(paint: Painter) -> None:
    paint.disc("l_shoulder", (0.028, 0.044), (0, -0.018, 0), (0, 1, 0), Material.GREY)
    upper_arm = loft(_UPPER_ARM, axis="x", domes=(0.018, 0.006))
    paint.shell("l_upper_arm", upper_arm, Material.WHITE)
    pad = panel(_UPPER_ARM, at=(-0.021, 0.034), angle=(-68, 68), axis="x", lift=0.0014, roundness=3.0)
    paint.shell("l_upper_arm", pad, Material.ORANGE)
    paint.ellipsoid("l_elbow", (0.024, 0.024, 0.024), (0, 0, 0), Material.GREY)
    paint.shell("l_forearm", loft(_FOREARM, axis="x", domes=(0.010, 0.004)), Material.WHITE)
    cuff = band(_FOREARM, at=(0.034, 0.0365), axis="x", lift=0.0005)
    paint.shell("l_forearm", cuff, Material.GREY)
    paint.disc("l_wrist_hand", (0.023, 0.014), (0.006, 0, 0), (1, 0, 0), Material.GREY)
    palm = loft(
        [
            Section(0.013, (0.022, 0.019), squareness=2.4),
            Section(0.034, (0.026, 0.018), squareness=2.6),
            Section(0.054, (0.023, 0.014), squareness=2.4),
        ],
        axis="x",
        domes=(0.004, 0.008),
    )
    paint.shell("l_wrist_hand", palm, Material.WHITE)
    for start, bend, end in (
        ((0.054, 0.013, 0.000), (0.074, 0.014, -0.004), (0.090, 0.012, -0.014)),
        ((0.056, -0.006, 0.000), (0.077, -0.007, -0.004), (0.093, -0.006, -0.014)),
        ((0.036, -0.022, -0.006), (0.056, -0.028, -0.014), (0.068, -0.024, -0.024)),
    ):
        paint.capsule("l_wrist_hand", 0.0078, (start, bend), Material.WHITE)
        paint.capsule("l_wrist_hand", 0.0070, (bend, end), Material.GREY)


def _paint_legs(paint: Painter) -> None:
    paint.ellipsoid("l_pelvis", (0.036, 0.034, 0.036), (-0.010, -0.002, 0.008), Material.GREY)
    paint.shell("l_thigh", loft(_THIGH, domes=(0.008, 0.014)), Material.WHITE)
    plate = panel(_THIGH, at=(-0.078, 0.010), angle=(-58, 58), taper=0.10, lift=0.0013, roundness=3.6)
    paint.shell("l_thigh", plate, Material.ORANGE)
    paint.disc("l_tibia", (0.029, 0.060), (0, 0.002, 0), (0, 1, 0), Material.GREY)
    paint.disc("l_tibia", (0.020, 0.068), (0, 0.002, 0), (0, 1, 0), Material.LIGHT_GREY)
    paint.shell("l_tibia", loft(_SHIN, domes=(0.008, 0.014)), Material.WHITE)
    _paint_plate(paint, "l_tibia", _SHIN, at=(-0.084, -0.012), reach=62.0, taper=0.08, roundness=3.6)
    paint.ellipsoid("l_ankle", (0.030, 0.030, 0.030), (0, 0, 0), Material.GREY)
    paint.shell("l_foot", loft(_FOOT, domes=(0.0, 0.006), slices=28), Material.WHITE)
    toe = panel(_FOOT, at=(-0.0415, -0.0300), angle=(-58, 58), lift=0.0016, grid=(5, 17))
    paint.shell("l_foot", toe, Material.ORANGE)
    paint.lamp("l_foot", (0.0065, 0.0040), (0.0640, 0.0050, -0.0120), (0.38, 0, 0.92), "Foot")
    sole = loft(
        [
            Section(-0.0451, (0.0755, 0.0450), (0.0245, 0.0055), 2.9),
            Section(-0.0395, (0.0765, 0.0460), (0.0245, 0.0055), 2.9),
        ],
        slices=28,
    )
    paint.shell("l_foot", sole, Material.DARK)
