"""The robot's skin: a white shell with grey joints and orange accents, drawn by our own hand.

Shapes are given for the left side, in m in the links' frames: x forward, y left, z up; of the arms, which
point forward when all joints are 0, x is along the limb.
"""

from __future__ import annotations

from naoserver_sim.appearance import Material, Painter
from naoserver_sim.mesh import Section, loft


def paint_skin(paint: Painter) -> None:
    """Show the skin."""
    _paint_head(paint)
    _paint_torso(paint)
    _paint_arms(paint)
    _paint_legs(paint)


def _paint_head(paint: Painter) -> None:
    skull = loft(
        [
            Section(0.004, (0.040, 0.041), (0.002, 0), 2.3),
            Section(0.022, (0.051, 0.053), (-0.002, 0), 2.4),
            Section(0.050, (0.058, 0.060), (-0.004, 0), 2.4),
            Section(0.075, (0.057, 0.059), (-0.005, 0), 2.3),
            Section(0.096, (0.046, 0.048), (-0.006, 0), 2.2),
        ],
        domes=(0.012, 0.0184),
        slices=28,
    )
    paint.shell("head", skull, Material.WHITE)
    paint.ellipsoid("head", (0.0285, 0.044, 0.042), (0.0285, 0, 0.047), Material.WHITE)
    eye, outward = (0.0515, 0.0265, 0.0500), (0.88, 0.47, 0.05)
    paint.disc("head", (0.0165, 0.006), eye, outward, Material.LED, twice=True)
    paint.disc("head", (0.0125, 0.008), eye, outward, Material.BLACK, twice=True)
    paint.disc("head", (0.0050, 0.004), (0.0548, 0, 0.0665), (0.97, 0, 0.25), Material.BLACK)
    paint.disc("head", (0.0050, 0.004), (0.0494, 0, 0.0177), (0.80, 0, -0.60), Material.BLACK)
    ear = (0.0, 0.0615, 0.050)
    paint.disc("head", (0.0310, 0.012), ear, (0, 1, 0), Material.ORANGE, twice=True)
    paint.disc("head", (0.0265, 0.015), ear, (0, 1, 0), Material.WHITE, twice=True)
    paint.disc("head", (0.0215, 0.016), ear, (0, 1, 0), Material.LED, twice=True)
    paint.disc("head", (0.0190, 0.017), ear, (0, 1, 0), Material.GREY, twice=True)
    for x, z in ((0.028, 0.1035), (0.0, 0.1115), (-0.028, 0.1045)):
        paint.ellipsoid("head", (0.012, 0.013, 0.004), (x, 0, z), Material.DARK)
    paint.disc("neck", (0.022, 0.050), (0, 0, -0.020), (0, 0, 1), Material.DARK)


def _paint_torso(paint: Painter) -> None:
    trunk = loft(
        [
            Section(-0.078, (0.034, 0.040), (-0.008, 0), 2.6),
            Section(-0.045, (0.043, 0.049), (-0.006, 0), 2.6),
            Section(-0.010, (0.044, 0.050), (-0.004, 0), 2.5),
            Section(0.030, (0.050, 0.059), (-0.003, 0), 2.6),
            Section(0.066, (0.053, 0.066), (-0.003, 0), 2.7),
            Section(0.094, (0.047, 0.061), (-0.004, 0), 2.6),
            Section(0.110, (0.034, 0.044), (-0.004, 0), 2.4),
        ],
        domes=(0.010, 0.008),
        slices=28,
    )
    paint.shell("torso", trunk, Material.WHITE)
    belly = loft(
        [
            Section(-0.050, (0.022, 0.030), (0.0165, 0), 2.4),
            Section(-0.020, (0.026, 0.036), (0.0165, 0), 2.4),
            Section(0.008, (0.026, 0.034), (0.0195, 0), 2.4),
        ],
        domes=(0.016, 0.014),
        slices=36,
    )
    paint.shell("torso", belly, Material.ORANGE)
    paint.disc("torso", (0.0125, 0.006), (0.0495, 0, 0.0552), (1, 0, 0.05), Material.LIGHT_GREY)
    paint.disc("torso", (0.0095, 0.008), (0.0495, 0, 0.0552), (1, 0, 0.05), Material.LED)
    for z in (0.070, 0.040):
        paint.disc("torso", (0.0085, 0.008), (0.0460, 0.0350, z), (0.95, 0.3, 0), Material.GREY, twice=True)


def _paint_arms(paint: Painter) -> None:
    paint.disc("l_shoulder", (0.027, 0.045), (0, -0.018, 0), (0, 1, 0), Material.GREY)
    upper_arm = loft(
        [
            Section(-0.020, (0.029, 0.034), (0.002, 0), 2.3),
            Section(0.000, (0.035, 0.039), (0.004, 0), 2.3),
            Section(0.030, (0.031, 0.034), (0.007, 0), 2.2),
            Section(0.062, (0.026, 0.028), (0.012, 0), 2.1),
            Section(0.084, (0.023, 0.025), (0.014, 0), 2.0),
        ],
        axis="x",
        domes=(0.018, 0.008),
    )
    paint.shell("l_upper_arm", upper_arm, Material.WHITE)
    paint.ellipsoid("l_upper_arm", (0.026, 0.010, 0.027), (0.0, 0.0325, 0), Material.ORANGE)
    paint.ellipsoid("l_elbow", (0.024, 0.024, 0.024), (0, 0, 0), Material.GREY)
    forearm = loft(
        [
            Section(0.006, (0.025, 0.026), squareness=2.2),
            Section(0.028, (0.032, 0.032), squareness=2.3),
            Section(0.050, (0.030, 0.030), squareness=2.3),
        ],
        axis="x",
        domes=(0.010, 0.006),
    )
    paint.shell("l_forearm", forearm, Material.WHITE)
    paint.disc("l_wrist_hand", (0.024, 0.012), (0.008, 0, 0), (1, 0, 0), Material.GREY)
    palm = loft(
        [
            Section(0.016, (0.023, 0.019), squareness=2.4),
            Section(0.036, (0.026, 0.018), squareness=2.5),
            Section(0.054, (0.023, 0.014), squareness=2.4),
        ],
        axis="x",
        domes=(0.006, 0.008),
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
    paint.ellipsoid("l_pelvis", (0.034, 0.032, 0.034), (-0.012, -0.002, 0.006), Material.GREY)
    thigh = loft(
        [
            Section(-0.086, (0.033, 0.034), (0.003, 0.003), 2.3),
            Section(-0.060, (0.040, 0.039), (0.006, 0.005), 2.4),
            Section(-0.022, (0.043, 0.041), (0.004, 0.006), 2.4),
            Section(0.010, (0.033, 0.034), (0.000, 0.004), 2.3),
        ],
        domes=(0.008, 0.014),
    )
    paint.shell("l_thigh", thigh, Material.WHITE)
    plate = loft(
        [
            Section(-0.062, (0.012, 0.022), (0.0365, 0.005), 2.4),
            Section(-0.040, (0.013, 0.026), (0.0365, 0.005), 2.4),
            Section(-0.018, (0.012, 0.024), (0.0360, 0.005), 2.4),
        ],
        domes=(0.014, 0.014),
        slices=36,
    )
    paint.shell("l_thigh", plate, Material.ORANGE)
    paint.disc("l_tibia", (0.030, 0.062), (0, 0.002, 0), (0, 1, 0), Material.GREY)
    shin = loft(
        [
            Section(-0.090, (0.033, 0.035), (-0.002, 0.003), 2.3),
            Section(-0.062, (0.043, 0.042), (-0.003, 0.004), 2.4),
            Section(-0.032, (0.042, 0.041), (-0.001, 0.004), 2.4),
            Section(-0.010, (0.034, 0.035), (0.001, 0.003), 2.3),
        ],
        domes=(0.008, 0.014),
    )
    paint.shell("l_tibia", shin, Material.WHITE)
    paint.ellipsoid("l_ankle", (0.030, 0.030, 0.030), (0, 0, 0), Material.GREY)
    foot = loft(
        [
            Section(-0.0440, (0.0745, 0.0440), (0.0245, 0.0055), 2.9),
            Section(-0.0300, (0.0745, 0.0445), (0.0245, 0.0055), 2.8),
            Section(-0.0150, (0.0600, 0.0400), (0.0150, 0.0045), 2.5),
            Section(0.0020, (0.0380, 0.0340), (0.0000, 0.0025), 2.3),
        ],
        domes=(0.0, 0.008),
        slices=28,
    )
    paint.shell("l_foot", foot, Material.WHITE)
    sole = loft(
        [
            Section(-0.0451, (0.0755, 0.0450), (0.0245, 0.0055), 2.9),
            Section(-0.0390, (0.0765, 0.0460), (0.0245, 0.0055), 2.9),
        ],
        slices=28,
    )
    paint.shell("l_foot", sole, Material.GREY)
