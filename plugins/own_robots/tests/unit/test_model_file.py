"""A user's model file: what is read of it, and that each fault ends in a sentence or a robot."""

import random
import re
import shutil

import mujoco
import numpy as np
import pytest

from naoserver.errors import RobotError
from plugins.own_robots.tests.support.robot_files import joint, link
from tests.support.meshes import cone, write_stl
from tests.support.models import FOLDER
from tests.support.soak import cases
from visualhfsm_own_robots._model_file import read_model

pytestmark = pytest.mark.sim

MESH = '<visual><geometry><mesh filename="package://arm/meshes/cone.stl" scale="1 1 1"/></geometry></visual>'
NAMES = ("coupled_arm.urdf", "tree.urdf", "walker.xml", "two_arms.xml", "parts.xml", "two_armed.urdf.xacro")
MODELS = {name: (FOLDER / name).read_text("utf-8") for name in NAMES}
ARM = MODELS["coupled_arm.urdf"]
ODD = (
    "nan",
    "1e400",
    "-inf",
    "",
    "abc",
    "1,5",
    "-1",
    "0",
    "1e30",
    "1e-30",
    "${x}",
    "9" * 5000,
    "nan-" * 40 + "x",
)


@pytest.fixture
def folder(tmp_path):
    """A folder with the files that the models name."""
    write_stl(tmp_path / "meshes/cone.stl", cone(0.1, 0.2, sides=6))
    shutil.copy(FOLDER / "common.xml", tmp_path)
    return tmp_path


@pytest.fixture
def read(folder):
    """Write a model, and read it."""

    def written(text, name="arm.urdf", **options):
        (folder / name).write_text(text)
        return read_model(folder / name, folder, **options)

    return written


@pytest.mark.parametrize("name", MODELS)
def test_each_model_is_read_without_a_word_on_stderr(read, name, capfd):
    model = read(MODELS[name], name)
    assert model.kind == ("mjcf" if name.endswith(".xml") else "urdf")
    assert model.spec.compile().njnt == model.compiled.njnt > 1
    assert capfd.readouterr().err == ""


FLAT = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]]


@pytest.mark.parametrize(
    ("triangles", "kind", "why"),
    [
        (FLAT, "visual", ""),
        (FLAT, "collision", "MuJoCo cannot use it: mesh '0' has coplanar vertices"),
        (FLAT[:1], "visual", "MuJoCo cannot use it: at least 4 vertices required"),
        (np.multiply(FLAT, 1e30), "visual", "MuJoCo cannot use it: stl_decoder: vertex"),
    ],
)
def test_a_mesh_that_mujoco_refuses_costs_its_shape(read, folder, triangles, kind, why):
    write_stl(folder / "meshes/cone.stl", triangles)
    model = read(ARM.replace("<visual>", f"<{kind}>").replace("</visual>", f"</{kind}>"))
    assert model.compiled.ngeom == (2 if why else 3)
    assert list(model.left_out) == (["package://arm/meshes/cone.stl"] if why else [])
    assert all(text.startswith(why) for text in model.left_out.values())


def test_a_link_whose_mass_was_that_of_such_a_mesh_becomes_a_small_ball(read, folder):
    write_stl(folder / "meshes/cone.stl", FLAT)
    shape = MESH.replace("visual", "collision")
    model = read(f"<robot>{link('base')}{link('arm', shape, '')}{joint('j', 'base', 'arm')}</robot>")
    assert model.compiled.body("arm").mass[0] == pytest.approx(0.01)
    assert "arm.urdf:2: body 'arm' has no mass: it is taken as a small ball" in model.notes[0]


def test_links_whose_masses_are_guessed_by_their_shapes_are_named(read):
    parts = [link("base"), link("upper", inertial=""), link("lower", inertial=""), link("tip")]
    joints = [
        joint("a", "base", "upper"),
        joint("b", "upper", "lower"),
        joint("c", "lower", "tip", kind="fixed"),
    ]
    notes = read(f"<robot>{''.join(parts + joints)}</robot>").notes
    (note,) = (each for each in notes if "without mass" in each)
    assert note.endswith(
        "arm.urdf: 'upper' without mass: taken as their shapes full of water, up to 1 kg each"
    )


def _number(text, chance):
    places = [found.span() for found in re.finditer(r"-?\d+\.?\d*", text)]
    start, end = chance.choice(places or [(0, 0)])
    return text[:start] + chance.choice(ODD) + text[end:]


def _value(text, chance):
    places = [found.span() for found in re.finditer(r'"[^"]*"', text)]
    start, end = chance.choice(places or [(0, 0)])
    other = chance.choice([*re.findall(r'"[^"]*"', text), *(f'"{odd}"' for odd in ODD)])
    return text[:start] + other + text[end:]


def _lines(text, chance):
    lines = text.splitlines(keepends=True)
    start, end = sorted(chance.sample(range(1, len(lines)), 2))
    place = chance.randrange(1, len(lines))
    kind = chance.choice(("dropped", "again", "moved", "often"))
    part = lines[start : chance.choice((start + 1, end))]
    if kind in ("dropped", "moved"):
        lines = [line for line in lines if line not in part]
    return "".join(
        [*lines[:place], *(part * (300 if kind == "often" else kind != "dropped")), *lines[place:]]
    )


def _depth(text, chance):
    tag = chance.choice(("a", "body", "link", "frame", "xacro:if"))
    depth = chance.choice((50, 300, 20_000))
    place = text.rindex("</")
    return text[:place] + f"<{tag}>" * depth + f"</{tag}>" * depth + text[place:]


def _size(text, chance):
    place = text.rindex("</")
    filler = chance.choice(
        (
            "<a/>" * 60_000,
            "x" * (11 << 20),
            "<a " + " ".join(f'a{n}=""' for n in range(500)) + "/>",
            '<worldbody><replicate count="100000"><body><geom size="1"/></body></replicate></worldbody>',
            '<size nuser_geom="100000000"/><custom><numeric name="n" size="100000000"/></custom>',
            '<asset><texture name="t" type="2d" builtin="flat" width="20000" height="20000"/></asset>',
            "".join(link(f"more{n}") for n in range(1500)),
        )
    )
    return text[:place] + filler + text[place:]


def _entities(text, chance):
    bomb = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 9))
    kinds = (f'<!DOCTYPE robot [<!ENTITY e0 "x">{bomb}]>', '<!DOCTYPE r SYSTEM "file:///etc/passwd">')
    start = text.index("?>\n") + 3 if text.startswith("<?") else 0
    return chance.choice((text[:start] + chance.choice(kinds) + text[start:], text.replace("0.1", "&e8;")))


def _torn(text, chance):
    place = chance.randrange(len(text))
    return chance.choice((text[:place], text[place:], text[:place] + "\0\xff<&" + text[place:]))


FAULTS = (_number, _number, _value, _value, _lines, _lines, _depth, _size, _entities)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("seed", cases(range(4), range(4, 50)))
def test_each_fault_ends_in_a_sentence_or_a_robot(read, name, seed):
    chance = random.Random(f"{name} {seed}")
    text = MODELS[name]
    for _ in range(chance.choice((1, 1, 2))):
        text = chance.choice(FAULTS)(text, chance)
    if chance.random() < 0.1:
        text = _torn(text, chance)
    try:
        found = read(text, name).compiled
    except RobotError as refused:
        found = str(refused)
    assert isinstance(found, mujoco.MjModel) or name in found or "common.xml:" in found
