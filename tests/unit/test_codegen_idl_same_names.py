from __future__ import annotations

import importlib
from pathlib import Path

from tests.support.slice_compiler import imported


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
