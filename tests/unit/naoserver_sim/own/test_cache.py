"""What is kept of meshes in the user's cache: found again, bounded, and never trusted."""

import errno
import hashlib
import os
import re
from pathlib import Path

import msgspec
import pytest

from naoserver_sim._own import cache as cache_module
from naoserver_sim._own import meshes
from naoserver_sim._own.cache import kept
from naoserver_sim._own.meshes import MeshError, MeshFile, read_mesh
from tests.support.meshes import cone


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """The folder of what is kept, in a cache of this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache/visualhfsm/models"


@pytest.fixture
def made():
    return []


@pytest.fixture
def keep(made):
    """Keep a text for some bytes; `made` has those that were not found."""

    def keeping(of=b"a", text=b"text"):
        def make():
            made.append(of)
            return text

        def read(content):
            if not content.startswith(b"te"):
                raise ValueError
            return content.decode()

        return kept((b"1", of), make, read)

    return keeping


def test_what_was_made_is_found_again(keep, made):
    assert [keep(b"a"), keep(b"b"), keep(b"a"), keep(b"b")] == ["text"] * 4
    assert made == [b"a", b"b"]


def test_where_one_of_the_bytes_ends_and_the_next_begins_counts():
    kept((b"ab", b"c"), lambda: b"one", bytes)
    assert kept((b"a", b"bc"), lambda: b"two", bytes) == b"two"


def test_only_the_user_may_read_what_is_kept(keep, cache):
    keep()
    assert [path.stat().st_mode & 0o777 for path in (cache, *cache.iterdir())] == [0o700, 0o600]


def damaged(path):
    path.write_bytes(path.read_bytes()[:-1])


def changed(path):
    content = b"evil"
    path.write_bytes(hashlib.sha256(content).digest() + content)


def linked(path):
    other = path.parent.parent / "other"
    path.rename(other)
    path.symlink_to(other)


def piped(path):
    path.unlink()
    os.mkfifo(path)


def huge(path):
    with path.open("ab") as file:
        file.truncate(1 << 40)


@pytest.mark.parametrize("harm", [damaged, changed, linked, piped, huge, lambda path: path.write_bytes(b"")])
def test_a_file_that_is_not_as_it_was_written_is_made_again(keep, made, cache, harm):
    keep()
    (path,) = cache.iterdir()
    harm(path)
    assert [keep(), keep()] == ["text", "text"]
    assert made == [b"a", b"a"]
    assert path.is_file()
    assert not path.is_symlink()


def test_a_folder_in_place_of_a_file_is_left_and_opens_nothing(keep, made, cache):
    keep()
    (path,) = cache.iterdir()
    path.unlink()
    path.mkdir()
    before = len(list(Path("/proc/self/fd").iterdir()))
    assert [keep(), keep()] == ["text", "text"]
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert [made, path.is_dir(), len(list(cache.iterdir()))] == [[b"a"] * 3, True, 1]


def test_what_can_only_be_read_is_found(keep, made, monkeypatch):
    def refuse(path):
        raise OSError(errno.EROFS, "Read-only file system", path)

    keep()
    monkeypatch.setattr(os, "utime", refuse)
    assert [keep(), made] == ["text", [b"a"]]


def test_nothing_is_left_of_what_a_full_disk_does_not_take(keep, made, cache, monkeypatch):
    def refuse(self, target):
        raise OSError(errno.ENOSPC, "No space left on device", str(target))

    monkeypatch.setattr(Path, "replace", refuse)
    assert [keep(), keep(), made] == ["text", "text", [b"a", b"a"]]
    assert list(cache.iterdir()) == []


@pytest.mark.parametrize("where", ["folder", "group", "another", "file", "link", "relative"])
def test_a_cache_that_others_may_write_to_is_left_alone(keep, made, cache, monkeypatch, where):
    tmp_path = cache.parents[2]
    cache.parent.mkdir(parents=True)
    if where in ("folder", "group"):
        cache.mkdir()
        cache.chmod(0o777 if where == "folder" else 0o770)
    elif where == "another":
        cache.mkdir(mode=0o700)
        monkeypatch.setattr(os, "geteuid", lambda: cache.stat().st_uid + 1)
    elif where == "file":
        cache.write_text("")
    elif where == "link":
        (tmp_path / "other").mkdir()
        cache.symlink_to(tmp_path / "other")
    else:
        monkeypatch.setenv("XDG_CACHE_HOME", "cache")
        monkeypatch.setenv("HOME", "/proc/none")
    assert [keep(), keep()] == ["text", "text"]
    assert made == [b"a", b"a"]
    assert not [path for path in tmp_path.rglob("*") if re.fullmatch("[0-9a-f]{64}", path.name)]


def test_those_that_were_used_longest_ago_go_first(keep, made, cache, monkeypatch):
    monkeypatch.setattr(cache_module, "MOST_KEPT", 2 * (32 + len("text")))
    for of in (b"a", b"b"):
        keep(of)
        for age, path in enumerate(sorted(cache.iterdir(), key=lambda path: path.stat().st_mtime)):
            os.utime(path, (age, age))  # long ago, in the order in which they were made
    keep(b"a")
    keep(b"c")
    assert len(list(cache.iterdir())) == 2
    assert [keep(b"a"), keep(b"c"), keep(b"b")] == ["text"] * 3
    assert made == [b"a", b"b", b"c", b"b"]


def test_a_folder_in_the_cache_does_not_keep_files_from_going(keep, cache, monkeypatch):
    monkeypatch.setattr(cache_module, "MOST_KEPT", 32 + len("text"))
    keep(b"a")
    (cache / "folder").mkdir()
    for path in cache.iterdir():
        os.utime(path, (2, 2) if path.is_dir() else (1, 1))
    keep(b"b")
    assert len(list(cache.iterdir())) == 2


def test_what_cannot_be_made_is_not_kept(cache):
    def make():
        raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        kept((b"a",), make, bytes)
    assert list(cache.iterdir()) == []


@pytest.fixture
def red_cone(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    solid = trimesh.Trimesh(
        cone(0.1, 0.2, sides=6).reshape(-1, 3), [[i, i + 1, i + 2] for i in range(0, 36, 3)]
    )
    solid.visual = trimesh.visual.TextureVisuals(
        material=trimesh.visual.material.SimpleMaterial(diffuse=[255, 0, 0])
    )
    (tmp_path / "a.dae").write_bytes(solid.export(file_type="dae"))
    return tmp_path / "a.dae"


@pytest.mark.slow
def test_a_mesh_is_converted_once(red_cone, monkeypatch):
    first = read_mesh(red_cone)
    monkeypatch.setattr(meshes, "_by_trimesh", lambda content, ending: pytest.fail("it is converted again"))
    assert read_mesh(red_cone) == first
    assert first.color is not None


def test_what_is_kept_of_a_format_is_not_another_ones(red_cone):
    read_mesh(red_cone)
    with pytest.raises(MeshError, match="it is broken"):
        read_mesh(red_cone.rename(red_cone.with_suffix(".ply")))


def test_another_converter_makes_it_again(red_cone, cache, monkeypatch):
    read_mesh(red_cone)
    monkeypatch.setattr(meshes, "_CONVERTER", -1)
    read_mesh(red_cone)
    assert len(list(cache.iterdir())) == 2


@pytest.mark.parametrize(
    "evil",
    [
        b"\xc1",
        msgspec.msgpack.encode(["stl", 7]),
        msgspec.msgpack.encode(MeshFile(".stl", b"cut off", None)),
        msgspec.msgpack.encode(MeshFile(".stl", bytes(80) + b"\xff\xff\xff\xff", None)),
        msgspec.msgpack.encode({"ending": ".stl"}),
    ],
)
def test_a_forged_mesh_is_converted_again(red_cone, cache, evil):
    first = read_mesh(red_cone)
    (path,) = cache.iterdir()
    path.write_bytes(hashlib.sha256(evil).digest() + evil)
    assert read_mesh(red_cone) == first


@pytest.mark.parametrize("color", [(2.0, 0.0, 0.0, 1.0), (0.0, 0.0), (float("nan"), 0.0, 0.0, 1.0)])
def test_a_forged_color_is_none(red_cone, cache, color):
    first = read_mesh(red_cone)
    (path,) = cache.iterdir()
    content = msgspec.msgpack.encode(first._replace(color=color))
    path.write_bytes(hashlib.sha256(content).digest() + content)
    assert read_mesh(red_cone) == first
