from __future__ import annotations

import importlib
from pathlib import Path

from codegen._idl import compile_interfaces
from codegen.diagnostics import Diagnostics
from tests.support.slice_compiler import imported, write_sources


def test_files_of_one_name_in_two_directories_can_define_parts_of_one_module(tmp_path: Path) -> None:
    sources = {
        "main.idl": '#include "store/metrics.idl"\nmodule m { struct All { Time time; Storage storage; }; };',
        "store/metrics.idl": '#include "../metrics.idl"\nmodule m { struct Storage { Time since; }; };',
        "metrics.idl": "module m { struct Time { int seconds; }; };",
    }
    with imported(tmp_path, "same_names", sources):
        module = importlib.import_module("same_names.m")
        storage = module.Storage(since=module.Time(seconds=1))
        assert module.All(time=module.Time(seconds=2), storage=storage).storage.since.seconds == 1


def test_files_of_one_name_keep_their_modules_whichever_files_are_given(tmp_path: Path) -> None:
    sources = {
        "main.idl": '#include "b/common.idl"\n#include "a/common.idl"\nmodule m { struct All { A a; B b; }; };',
        "a/common.idl": "module m { struct A { int a; }; };",
        "b/common.idl": "module m { struct B { int b; }; };",
    }
    main, first, second = write_sources(tmp_path, sources)
    alone = _compiled([main], tmp_path)
    assert {path.name for path in alone} >= {"common.py", "a_common.py"}
    assert _compiled([main, first, second], tmp_path) == alone
    assert _compiled([second, main], tmp_path) == alone


def test_an_included_file_makes_the_same_whether_it_is_given_or_not(tmp_path: Path) -> None:
    sources = {
        "arm.idl": '#include "common.idl"\nmodule m { interface Arm { void raise(); }; };',
        "common.idl": "module m { interface Arm; sequence<Arm*> Arms; struct Robot { Arms arms; }; };",
    }
    arm, common = write_sources(tmp_path, sources)
    alone = _compiled([arm], tmp_path)
    assert _compiled([arm, common], tmp_path) == alone
    own = _compiled([common], tmp_path)
    module = tmp_path / "out" / "m" / "common.py"
    assert own[module] == alone[module]


def test_an_included_file_that_needs_its_includer_is_compiled_with_it(tmp_path: Path) -> None:
    sources = {
        "main.idl": 'module m { struct Time { int t; }; };\n#include "part.idl"',
        "part.idl": "module m { struct Part { Time since; }; };",
    }
    main, _ = write_sources(tmp_path, sources)
    compiled = _compiled([main], tmp_path)
    assert "Time" in compiled[tmp_path / "out" / "m" / "part.py"]


def _compiled(given: list[Path], directory: Path) -> dict[Path, str]:
    diagnostics = Diagnostics()
    compilation = compile_interfaces(given, [], directory / "out", diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    return {file.path: file.text for file in compilation.files}


def test_no_file_hides_a_module_that_another_file_puts_beside_it(tmp_path: Path) -> None:
    sources = {
        "y.idl": "module m { struct S { int a; }; };",
        "x.idl": '#include "y.idl"\nmodule m { module y { struct T { m::S s; }; }; };',
    }
    paths = write_sources(tmp_path, sources)
    texts = []
    for given in (paths, paths[::-1]):
        compilation = compile_interfaces(given, [], None, Diagnostics())
        texts.append({file.path: file.text for file in compilation.files})
    assert texts[0] == texts[1]
    names = {str(path.relative_to(tmp_path / "m")) for path in texts[0]}
    assert {"y_idl.py", "y/x.py"} <= names
    assert "y.py" not in names
    with imported(tmp_path, "hidden_out", sources) as package:
        module = __import__(f"{package.__name__}.m.y", fromlist=["T"])
        assert module.T.__annotations__ == {"s": "S"}
