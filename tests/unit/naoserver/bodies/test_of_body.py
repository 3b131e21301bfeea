"""The looks of each body: its own, on links that it has, or its contact shapes."""

import mujoco
import numpy as np
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.description import describe_looks, looks_of, start_of
from naoserver.bodies.looks import read_looks
from naoserver.bodies.parts import Link, Shape
from naoserver.body import Body
from naoserver_sim.appearance import add_appearance

TURN = (0.5, 0.5, -0.5, 0.5)
SHAPES = (
    Shape(link="base", kind="sphere", size=(0.1,), position=(1.0, 2.0, 3.0)),
    Shape(link="base", kind="box", size=(0.1, 0.2, 0.3), position=(1.0, 2.0, 3.0), turn=TURN),
    Shape(link="base", kind="ellipsoid", size=(0.1, 0.2, 0.3), turn=TURN),
    Shape(link="base", kind="cylinder", size=(0.1, 0.2), position=(1.0, 2.0, 3.0), turn=TURN),
    Shape(link="base", kind="capsule", size=(0.1, 0.2), position=(1.0, 2.0, 3.0), turn=TURN),
    Shape(link="base", kind="capsule", size=(0.1,), ends=((1.0, 2.0, 3.0), (1.5, 2.0, 2.0))),
)


def body_of(*shapes):
    return Body(name="Test", links=(Link(name="base", mass=1.0),), shapes=shapes)


def axes_of(quaternion):
    """Return the axes of a shape as the columns of a matrix."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


@pytest.mark.parametrize("name", BODY_NAMES)
def test_a_body_has_the_links_and_the_lights_of_its_looks(name):
    body, skin = find_body(name), looks_of(find_body(name)).skin
    seen = {part.link for shell in (True, False) for part in skin.parts(shell=shell)}
    assert seen <= {link.name for link in body.links}
    assert set(skin.lights) == start_of(body).keys()


def test_the_bodies_of_a_folder_look_alike():
    assert looks_of(find_body("H21")) == looks_of(find_body("H25")) == read_looks("nao")


@pytest.mark.sim
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: f"{shape.kind} {len(shape.size)}")
def test_of_another_body_its_contact_shapes_are_seen(shape):
    spec = mujoco.MjSpec()
    spec.add_default("skin", spec.default)
    base = spec.worldbody.add_body(name="base")
    place = {"pos": shape.position, "quat": shape.turn}
    if shape.ends is not None:
        place = {"fromto": np.ravel(shape.ends)}
    kind = getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}")
    base.add_geom(type=kind, size=[*shape.size, 0.0, 0.0][:3], **place)
    add_appearance(spec, {"base": base}, looks_of(body_of(shape)), skin=True, colors={})
    mj = spec.compile()
    touched, seen = range(mj.ngeom)
    (described,) = describe_looks(looks_of(body_of(shape)), {}).shapes
    assert mj.geom_rbound[seen] == pytest.approx(mj.geom_rbound[touched])
    assert mj.geom_pos[seen] == pytest.approx(mj.geom_pos[touched])
    assert described.position == pytest.approx(mj.geom_pos[touched], abs=1e-5)
    own_axes = 3 if shape.kind in ("box", "ellipsoid") else 1  # the others are round about the last one
    assert described.quaternion is not None
    for turn in (mj.geom_quat[seen], np.roll(described.quaternion, 1)):
        along = np.sum(axes_of(turn) * axes_of(mj.geom_quat[touched]), axis=0)
        assert np.abs(along[-own_axes:]) == pytest.approx(1.0, abs=1e-4)
