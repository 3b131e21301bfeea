"""What is kept of large models: the same body, found as long as nothing of it has changed."""

import hashlib
import logging

import msgspec
import numpy as np
import pytest

from naoserver.bodies.looks.description import write_looks
from naoserver.body import write_body
from naoserver.errors import RobotError
from naoserver_sim import _own_body
from naoserver_sim._own import kept_bodies
from naoserver_sim._own.looks import looks_in
from naoserver_sim._own_body import read_own_body
from tests.support.meshes import cone, write_stl
from tests.support.models import FOLDER

pytestmark = pytest.mark.sim

MODEL = (FOLDER / "stump.urdf").read_text("utf-8")


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """The folder of what is kept, in a cache of this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache/visualhfsm/models"


@pytest.fixture
def model(tmp_path):
    (tmp_path / "stump.urdf").write_text(MODEL)
    write_stl(tmp_path / "base.stl", cone(0.2, 0.4, sides=220, rings=50))
    return tmp_path / "stump.urdf"


@pytest.fixture
def reads(monkeypatch, caplog):
    """Read a body; return it as texts, all that was said and logged, and how often a model was compiled whole."""
    compiled = []

    def counted(*given):
        compiled.append(given)
        return looks_in(*given)

    monkeypatch.setattr(_own_body, "looks_in", counted)

    def read(path, text=None):
        said: list[str] = []
        before = len(compiled)
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            body = read_own_body(path, text, say=said.append)
        return (write_body(body), write_looks(body), said, caplog.messages), len(compiled) - before

    return read


def test_the_second_time_the_same_body_is_found_and_the_same_is_said(model, reads):
    write_stl(model.with_name("base.stl"), cone(0.2, 0.4, sides=400, rings=60))
    first, compiled = reads(model)
    assert compiled == 1
    assert first[2][0] == "stump.urdf: 2 links, 1 joints, 3 kg, free to move"
    assert any("of the 48000 triangles" in each for each in first[3])
    assert reads(model) == (first, 0)


def test_it_is_read_again_when_the_model_a_mesh_or_the_file_that_names_it_changes(model, reads):
    first, _ = reads(model)
    model.write_text(MODEL.replace('effort="9"', 'effort="7"'))
    changed, compiled = reads(model)
    assert (compiled, changed[0] == first[0]) == (1, False)
    write_stl(model.with_name("base.stl"), cone(0.3, 0.4, sides=220, rings=50))
    assert reads(model)[1] == 1
    described = model.with_suffix(".toml")
    assert [reads(described, f'model = "stump.urdf"\nname = "{name}"')[1] for name in ("A", "B", "A")] == [
        1,
        1,
        0,
    ]


def test_it_is_read_again_where_its_lines_or_its_path_are_others(model, reads, tmp_path):
    reads(model)
    model.write_text("\n" + MODEL)
    assert reads(model)[1] == 1
    (tmp_path / "other").mkdir()
    for file in (model, model.with_name("base.stl")):
        (tmp_path / "other" / file.name).write_bytes(file.read_bytes())
    assert reads(tmp_path / "other/stump.urdf")[1] == 1


def test_other_code_reads_it_again(model, reads, monkeypatch):
    reads(model)
    monkeypatch.setattr(kept_bodies, "_code", lambda: b"of tomorrow")
    assert reads(model)[1] == 1


def test_a_small_model_is_not_kept(model, reads, cache):
    write_stl(model.with_name("base.stl"), cone(0.2, 0.4, sides=30))
    assert [reads(model)[1], reads(model)[1], cache.exists()] == [1, 1, False]


def test_what_is_wrong_is_not_kept(model, cache):
    text = 'model = "stump.urdf"\n[groups]\nhead = ["knee"]\n'
    for _ in range(2):
        with pytest.raises(RobotError, match="knee"):
            read_own_body(model.with_suffix(".toml"), text)
    assert not cache.exists() or not list(cache.iterdir())


@pytest.mark.parametrize(
    "forge",
    [
        lambda kept: b"\xc1",
        lambda kept: [kept[0].replace("neck", "\n"), *kept[1:]],
        lambda kept: [kept[0][:-1], *kept[1:]],
        lambda kept: [kept[0], None],
        lambda kept: [
            *kept[:2],
            {name: [each[0][:-1], *each[1:]] for name, each in kept[2].items()},
            *kept[3:],
        ],
        lambda kept: [
            *kept[:2],
            {
                name: [each[0], np.full(3, 1 << 30, "<i4").tobytes(), each[2]]
                for name, each in kept[2].items()
            },
            *kept[3:],
        ],
    ],
)
def test_a_forged_body_is_read_again(model, reads, cache, forge):
    first, _ = reads(model)
    (path,) = cache.iterdir()
    forged = forge(msgspec.msgpack.decode(path.read_bytes()[32:]))
    content = forged if isinstance(forged, bytes) else msgspec.msgpack.encode(forged)
    path.write_bytes(hashlib.sha256(content).digest() + content)
    assert reads(model) == (first, 1)
