"""What the compiler accepts becomes packages that import, pass type checkers and hold any value."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import msgspec
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from codegen._idl import compile_interfaces
from codegen.diagnostics import Diagnostics
from codegen.files import apply, compare_with_disk
from tests.support.examples import examples
from tests.support.generated_types import structs_of
from tests.support.limits import RUN_LIMIT
from tests.support.places import DATA, ROOT
from tests.support.slice_cases import all_cases
from tests.support.slice_compiler import imported, sources_of, write_sources
from tests.support.slice_grammar import slice_files
from tests.support.soak import repeated
from tests.support.wire_values import TOGETHER, Desk, pack, packed, plain, struct_values, unpacked
from zenoh_ice import MarshalException
from zenoh_ice.data.codec import Codec

PROGRAMS = sorted(directory for directory in (DATA / "slice_output").iterdir() if directory.is_dir())
AWKWARD = DATA / "slice_awkward"
DESK = Desk()


@pytest.fixture(scope="module", params=PROGRAMS, ids=lambda path: path.name)
def package(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    home = tmp_path_factory.mktemp(request.param.name)
    with imported(home, f"output_{request.param.name}", sources_of(request.param)) as module:
        yield module


def check_any_values(structs: list[type[msgspec.Struct]]) -> None:
    codecs = [Codec(struct) for struct in structs]

    @settings(max_examples=examples(6), deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.tuples(*(struct_values(struct, DESK) for struct in structs)))
    def round_trip(values: tuple[msgspec.Struct, ...]) -> None:
        for value, codec in zip(values, codecs, strict=True):
            payload = pack(codec, tuple(getattr(value, name) for name in codec.fields), "x")
            assert unpacked(payload) == plain(value)
            assert codec.unpack(packed(plain(value)), "x", DESK.stringToProxy) == value

    round_trip()


@pytest.mark.slow
def test_any_value_crosses_the_wire(package: ModuleType) -> None:
    structs = structs_of(package)
    for first in range(0, len(structs), TOGETHER):
        check_any_values(structs[first : first + TOGETHER])


def test_members_that_are_missing_are_refused_unless_they_are_optional(package: ModuleType) -> None:
    for struct in structs_of(package):
        codec = Codec(struct)
        optional = all(
            not field.required and type(None) in getattr(field.type, "__args__", ())
            for field in msgspec.structs.fields(struct)
        )
        if optional:
            continue
        with pytest.raises(MarshalException, match="missing required field"):
            codec.unpack(b"\x80", "x", DESK.stringToProxy)


def run_checker(command: list[str], cwd: Path) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=RUN_LIMIT, cwd=cwd, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def generate(sources: dict[str, str], home: Path) -> bool:
    """Compile files to the package `api` of a directory; return whether they were accepted."""
    directory = home / "idl"
    paths = []
    for name, text in sources.items():
        paths.append(directory / name)
        paths[-1].parent.mkdir(parents=True, exist_ok=True)
        paths[-1].write_text(text)
    diagnostics = Diagnostics()
    compilation = compile_interfaces(paths, [], home / "api", diagnostics)
    if not diagnostics.has_errors:
        apply(compare_with_disk(compilation.files))
    return not diagnostics.has_errors


@pytest.mark.slow
def test_the_output_is_the_same_whatever_the_order_and_the_hashes(tmp_path: Path) -> None:
    everything = []
    for seed in ("1", "2"):
        output = tmp_path / seed
        paths = [str(path) for directory in [*PROGRAMS, AWKWARD] for path in sorted(directory.iterdir())]
        program = "from codegen.__main__ import main; main()"
        command = [sys.executable, "-c", program, *(paths if seed == "1" else paths[::-1]), "-o", str(output)]
        subprocess.run(
            command,
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
            timeout=RUN_LIMIT,
            cwd=ROOT,
        )
        files = sorted(path for path in output.rglob("*") if path.is_file())
        everything.append({path.relative_to(output): path.read_bytes() for path in files})
    assert everything[0] == everything[1]
    assert len(everything[0]) > 10


def test_a_file_that_several_include_comes_out_the_same_whatever_their_order(tmp_path: Path) -> None:
    sources = {
        "common.idl": "#pragma once\nmodule m { interface Arm; sequence<Arm*> Arms; };",
        "arm.idl": '#include "common.idl"\nmodule m { interface Arm { void rest(); }; };',
        "body.idl": '#include "common.idl"\nmodule m { struct Body { Arms arms; }; };',
    }
    write_sources(tmp_path, sources)
    paths = [tmp_path / "arm.idl", tmp_path / "body.idl"]
    one, other = (
        compile_interfaces(order, [], tmp_path / "api", Diagnostics()).files for order in (paths, paths[::-1])
    )
    assert {file.path: file.text for file in one} == {file.path: file.text for file in other}


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with a package for every program, awkward names, accepted cases, and files made from the grammar."""
    root = tmp_path_factory.mktemp("corpus")
    for directory in PROGRAMS:
        assert generate(sources_of(directory), root / f"program_{directory.name}")
    assert generate(sources_of(AWKWARD), root / "awkward_names")
    for number, case in enumerate(case for case in all_cases() if case.ours.accepted):
        generate(case.files, root / f"case_{number}")
    texts: list[str] = []

    @settings(
        max_examples=repeated(15, 60), deadline=None, phases=[Phase.generate], database=None, derandomize=True
    )
    @given(slice_files())
    def collect(text: str) -> None:
        texts.append(text)

    collect()
    for number, text in enumerate(texts):
        if not generate({"main.ice": text}, root / f"grammar_{number}"):
            shutil.rmtree(root / f"grammar_{number}")
    for home in root.iterdir():
        shutil.rmtree(home / "idl")
        (home / "__init__.py").touch()
    return root


@pytest.mark.slow
def test_the_output_of_the_corpus_imports(corpus: Path) -> None:
    program = """
import importlib, pkgutil, sys
for package in sys.argv[1:]:
    for module in pkgutil.walk_packages(importlib.import_module(package).__path__, package + "."):
        importlib.import_module(module.name)
"""
    packages = sorted(home.name for home in corpus.iterdir() if (home / "api").is_dir())
    assert len(packages) > 100
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(Path.cwd())!r})\n{program}"]
    run_checker([*command, *(f"{package}.api" for package in packages)], corpus)


@pytest.mark.slow
def test_the_output_of_the_corpus_passes_mypy(corpus: Path) -> None:
    # Not with the cache of `make lint`, which may run at the same time and locks it.
    mypy = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull]
    run_checker([*mypy, str(corpus)], ROOT)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("pyright") is None, reason="pyright is not installed")
def test_the_output_of_the_corpus_passes_pyright(corpus: Path) -> None:
    config = {"include": [str(corpus)], "extraPaths": [str(ROOT)]}
    (corpus / "pyrightconfig.json").write_text(json.dumps(config))
    run_checker(["pyright", "-p", str(corpus), "--pythonpath", sys.executable], corpus)
