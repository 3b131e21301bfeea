"""What user code does with the module `time` goes by the virtual clock."""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.support.documents import compile_to, document, state, sub
from visualhfsm.testing import BehaviorFailed, MakeBehavior


def write(directory: Path, *parts: str) -> Path:
    path = directory / "written.xml"
    path.write_text(document(*parts), encoding="utf-8")
    return path


SLEEP = "time.sleep(7.25)\nasleep = time.monotonic()"


@pytest.mark.parametrize(
    ("code", "others"),
    [
        (SLEEP, {"libraries": ("import time",)}),
        (SLEEP.replace("time.", ""), {"libraries": ("from time import monotonic, sleep",)}),
        (SLEEP, {"variables": "import time"}),
        (f"import time\n{SLEEP}", {}),
        ("asleep = self.nap()", {"functions": "def nap(self):\n    import time\n    time.sleep(7.25)\n"
                                 "    return time.monotonic_ns() / 1e9"}),
    ],
    ids=["library", "from library", "variables", "state", "function"],
)  # fmt: skip
def test_a_sleep_lasts_its_time_by_the_clock(
    behavior: MakeBehavior, tmp_path: Path, code: str, others: dict[str, Any]
) -> None:
    libraries = others.pop("libraries", ())
    variables = f"asleep = 0.0\n{others.pop('variables', '')}"
    only = sub(1, 0, state(1, "only", code, initial=True), variables=variables, **others)
    path = tmp_path / "written.xml"
    path.write_text(document(only, libraries=libraries), encoding="utf-8")
    b = behavior(path)
    b.advance(7.0)
    assert b.variables("written")["asleep"] == 0.0
    b.advance(0.25)
    assert b.variables("written")["asleep"] == 7.25
    b.reload(path)
    b.advance(7.3)
    assert b.variables("written")["asleep"] == pytest.approx(14.55)
    assert time.sleep is __import__("time").sleep


def test_a_sleep_of_an_extension_and_of_a_component_from_a_module_lasts_its_time(
    behavior: MakeBehavior, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "napper_ext.py").write_text(
        "import time\nclass NapperExtension:\n    def nap(self): time.sleep(7.25)\n"
    )
    only = sub(1, 0, state(1, "only", "self.nap()\ntime.sleep(1.0)", initial=True))
    compile_to(tmp_path, document(only, libraries=("import time",)), "napper")
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("napper")
    for b in (behavior(tmp_path / "napper.xml"), behavior(module.Napper), behavior(module.Napper)):
        b.advance(8.2)
        assert b.in_cycle
        b.advance(0.05)
        assert not b.in_cycle
    assert module.time is time
    for name in ("napper", "napper_ext"):
        del sys.modules[name]


@pytest.mark.slow
def test_dates_go_on_with_the_time(behavior: MakeBehavior, tmp_path: Path) -> None:
    variables = "import time\nstart = time.time()\nlasted = 0.0"
    code = "lasted = time.time() - start"
    before = int(time.time())
    b = behavior(write(tmp_path, sub(1, 0, state(1, "only", code, initial=True), variables=variables)))
    b.advance(3600.0)
    assert b.variables("written")["lasted"] == pytest.approx(3600.0)
    assert before <= b.variables("written")["start"] <= time.time()


def test_a_date_has_no_fraction_that_is_different_in_each_run(behavior: MakeBehavior, tmp_path: Path) -> None:
    only = state(1, "only", "date = time.time()", initial=True)
    b = behavior(write(tmp_path, sub(1, 0, only, variables="import time\ndate = 0.0")))
    b.advance(0.0)
    date = b.variables("written")["date"]
    assert date == int(date) > 0


def test_a_thread_of_user_code_sleeps_by_the_wall(behavior: MakeBehavior, tmp_path: Path) -> None:
    code = (
        "import threading, time\nthread = threading.Thread(target=time.sleep, args=(0.01,))\n"
        "thread.start()\nthread.join(10)"
    )
    b = behavior(write(tmp_path, sub(1, 0, state(1, "only", code, initial=True))))
    b.advance(0.0)
    assert b.time == 0.0


def test_a_negative_sleep_is_an_error(behavior: MakeBehavior, tmp_path: Path) -> None:
    code = "import time\ntime.sleep(-1)"
    b = behavior(write(tmp_path, sub(1, 0, state(1, "only", code, initial=True))))
    with pytest.raises(BehaviorFailed, match="ValueError: sleep length must be non-negative"):
        b.advance(0.0)
