"""Code that an agent may run, and code that it may not: what reaches files, programs, or around the proxies."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.soak import repeated
from visualhfsm import Project
from visualhfsm_agent._code import require_tame
from visualhfsm_agent._limits import AgentError

_TAME = [
    "import math\nx = math.pi",
    "import numpy as np\nx = np.zeros(3).copy() + np.linalg.norm(np.ones(2))",
    "import numpy as np\nx = np.ones((2, 3))\ny = x.shape, x.T.reshape(-1).tolist(), x.sum(), x.dtype.name",
    "from collections import deque\nx = deque([1])\ny = [1].index(1), 'a-b'.partition('-')",
    "import json\nx = json.loads('{}')",
    "import time\ntime.sleep(0.1)",
    "import random\nx = random.uniform(0, 1)",
    "x = getattr(object(), 'height', 0)",
    "class Helper:\n    def __init__(self):\n        self.own = 1\n",
    "x = [n for n in range(3)]",
    "import cv2\nx = cv2.COLOR_RGB2HSV",
    "class A:\n    def f(self, side):\n        return getattr(self, f'{side}Motors')",
]
_WILD = [
    "import os",
    "import os.path as p",
    "import sys",
    "import subprocess",
    "import socket",
    "import ctypes",
    "import pathlib",
    "import builtins",
    "import importlib",
    "import zenoh",
    "import zenoh_ice",
    "import threading",
    "import asyncio",
    "from zenoh_ice import initialize",
    "from hfsm_runtime import run",
    "from hfsm_runtime import main as m",
    "from hfsm_runtime.loading import load_module",
    "from interfaces.nao import *",
    "from interfaces.nao import PoseHeadPrx as P",
    "from . import other",
    "from random import _os",
    "from json import codecs",
    "open('/etc/hostname')",
    "f = open\nf('x')",
    "eval('1')",
    "exec('x = 1')",
    "compile('1', '', 'eval')",
    "__import__('os')",
    "__builtins__['open']",
    "globals()['x']",
    "vars(object())",
    "getattr(object(), '_' + '_class_' + '_')",
    "getattr(object(), '__class__')",
    "getattr(object(), name)",
    "class A:\n    def f(self, x):\n        return getattr(self, f'{x}__')",
    "setattr(object(), 'ice_x', 1)",
    "().__class__.__bases__",
    "(lambda: 0).__globals__",
    "import random\nrandom._os.system('true')",
    "import json\njson.codecs.open('x')",
    "import dataclasses\ndataclasses.sys.modules",
    "import dataclasses\ndataclasses.inspect.builtins",
    "import enum\nenum.sys",
    "import typing\ntyping.sys",
    "import collections\ncollections._sys",
    "import numpy as np\nnp.load('x')",
    "import numpy as np\nnp.fromfile('x')",
    "import numpy as np\nnp.ones(3).tofile('x')",
    "import numpy as np\nnp.ones(3).resize(3)",
    "import numpy as np\nresize = np.ones(3).resize",
    "import numpy as np\ngetattr(np.ones(3), 'resize')",
    "match object():\n    case object(resize=x):\n        pass",
    "import numpy as np\nnp.ones(3).view('f8')",
    "import numpy as np\nnp.ones(3).setfield(1.0, 'f8')",
    "import numpy as np\nnp.ones(3).flags",
    "import numpy as np\nnp.ones(3).strides",
    "import numpy as np\nx = np.ones(3)\nx.shape = 3, 1",
    "import numpy as np\nx = np.ones(3)\nx.dtype = 'f8'",
    "import numpy as np\nx = np.ones(3)\nfor x.shape in [(3, 1)]:\n    pass",
    "import numpy as np\nsetattr(np.ones(3), 'shape', (3, 1))",
    "import functools\nfunctools.cmp_to_key",
    "import numpy as np\nnp.ctypeslib",
    "import numpy.ctypeslib",
    "import cv2\ncv2.imread('x')",
    "import cv2\ncv2.VideoCapture(0)",
    "import statistics\nstatistics.sys",
    "class A:\n    def f(self):\n        self.Head.ice_getCommunicator()",
    "class A:\n    def f(self):\n        self.Head.checkedCast(1)",
    "class A:\n    def f(self):\n        self.__dict__",
    "class A:\n    def f(self):\n        self._hfsm_runtime",
    "class A:\n    def f(self):\n        type(self.Head).setPose(self.Head, 1, 1, 1)",
    "from interfaces.nao import PoseHeadPrx\nclass A:\n    def f(self):\n        PoseHeadPrx.setPose(self.Head, 1, 1, 1)",
    "import interfaces.nao\ninterfaces.nao.PoseHeadPrx",
    "match object():\n    case object(__class__=x):\n        pass",
    "load_extension('/tmp/x.py', None, 'x', 'X')",
    "load_extension(__file__, 'os', 'path', 'X')",
    "x = __file__",
    "import random\nself = random\nself._os",
    "class A:\n    def f(self, x):\n        return getattr(self, f'{x}e')",
    "(x for x in ()).gi_frame",
    "def f(frame):\n    return frame.f_builtins",
    "import enum\nenum.bltns",
    "import string\nstring.Formatter",
    "'{0.__class__}'.format(0)",
    "import typing\ntyping.get_type_hints(0)",
    "import typing\ntyping.ForwardRef('1')",
    "import functools\nfunctools.singledispatch",
    "import functools\nfunctools.update_wrapper",
    "import collections\ncollections.abc.ABCMeta",
    "import enum\nenum.EnumType",
    "import dataclasses\ndataclasses.make_dataclass",
    "from json.tool import Path",
    "import numpy.ma.mrecords",
    "import numpy as np\nnp.lib.recfunctions.mrec",
    "import numpy as np\nnp.lib.stride_tricks.as_strided",
    "import cv2\ncv2.load_config_py3",
    "import cv2\ncv2.writeOpticalFlow",
    "import cv2\ncv2.CascadeClassifier_convert",
    "import cv2\ncv2.dnn_DetectionModel",
    "import cv2\ncv2.imreadWithMetadata",
    "class A:\n    def f(self):\n        self.Head.setPose.call_encoded(b'')",
    "class A:\n    def f(self):\n        del self.Head.setPose",
    "class A:\n    def f(self):\n        A.Head.type",
    "class A:\n    def __exit__(self, kind, value, trace):\n        pass",
    "class A(str):\n    def __eq__(self, other):\n        return True",
    "from hfsm_runtime import main\nclass A: pass\nmain(A)",
    "__name__ = '__main__'",
    "match '__main__':\n    case __name__:\n        pass",
    "def Proxy(identity, kind):\n    pass",
    "from hfsm_runtime import Proxy\nP = Proxy",
    "import component\ncomponent.main",
    "import component\ncomponent.load_extension",
    "breakpoint()",
    "input()",
    "help()",
    "x = (",
    "x = '\ud800'",
]


def judge(folder: Path, code: str, name: str = "component.py") -> None:
    (folder / name).write_text(code, errors="surrogatepass")
    require_tame(folder)


@pytest.mark.parametrize("code", _TAME)
def test_code_that_computes_and_calls_may_run(tmp_path: Path, code: str) -> None:
    judge(tmp_path, code)


@pytest.mark.parametrize("code", _WILD)
def test_code_that_leads_elsewhere_may_not(tmp_path: Path, code: str) -> None:
    with pytest.raises(AgentError, match=r"component\.py"):
        judge(tmp_path, code)


@pytest.mark.parametrize("code", ["import os", "x = ().__class__"])
def test_the_same_holds_of_files_beside_it_and_below(tmp_path: Path, code: str) -> None:
    judge(tmp_path, "x = 1")
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "helper.py").write_text(code)
    with pytest.raises(AgentError, match=r"helper\.py"):
        require_tame(tmp_path)


@pytest.mark.parametrize("name", ["os", "subprocess", "numpy", "zenoh_ice", "msgspec"])
def test_code_beside_it_has_no_name_of_what_is_installed(tmp_path: Path, name: str) -> None:
    (tmp_path / f"{name}.py").write_text("x = 1")
    with pytest.raises(AgentError, match="installed module"):
        judge(tmp_path, f"import {name}")


def test_code_beside_it_may_be_imported(tmp_path: Path) -> None:
    (tmp_path / "helper.py").write_text("x = 1")
    judge(tmp_path, "from helper import x")


@pytest.mark.slow
@pytest.mark.parametrize(
    "document",
    [
        *ROOT.glob("shelf/*.xml"),
        *(ROOT / f"behaviors/{name}.xml" for name in ("dance", "dance_and_follow", "get_up")),
    ],
    ids=lambda path: path.stem,
)
def test_ready_states_and_experiments_may_run(tmp_path: Path, document: Path) -> None:
    with Project(document.parent) as project:
        project.open(document).generate(tmp_path)
    require_tame(tmp_path)


@pytest.mark.parametrize("kind", [np.ndarray, np.dtype, np.ufunc, np.flatiter])
def test_of_an_array_code_may_use_what_is_listed_and_nothing_that_numpy_has_besides(
    tmp_path: Path, kind: type
) -> None:
    """Also of a NumPy of later: what changes memory below views is not among what is listed."""
    refused = set()
    for name in dir(kind):
        try:
            judge(tmp_path, f"x = 1\nx.{name}")
        except AgentError:
            refused.add(name)
    assert refused >= {each for each in dir(kind) if each.startswith("_")}
    unlisted = {
        "resize",
        "view",
        "setfield",
        "getfield",
        "byteswap",
        "setflags",
        "flags",
        "strides",
        "ctypes",
        "base",
    }
    assert refused >= unlisted & {*dir(kind)}
    assert {*dir(kind)} - refused <= _LISTED


_LISTED = frozenset(
    re.findall(
        r"\w+",
        """
        T all any argmax argmin argpartition argsort astype choose clip compress conj conjugate copy cumprod cumsum
        data diagonal dot dtype fill flat flatten imag item itemsize max mean min nbytes ndim nonzero partition
        prod put ravel real repeat reshape round searchsorted shape size sort squeeze std sum swapaxes take
        tobytes tolist trace transpose var kind name num str accumulate at identity outer reduce signature types
        coords index
        """,
    )
)

_RUNS = """
import sys
for program in sys.stdin.read().split("\\0"):
    try:
        exec(program, {})
    except Exception:
        pass
print("done")
"""


@pytest.mark.slow
def test_generated_programs_of_arrays_end_by_no_signal(tmp_path: Path) -> None:
    draw = Random(1)
    methods = sorted(_LISTED & {*dir(np.ndarray)})
    arguments = [
        "",
        "0",
        "1",
        "-1",
        "2, 3",
        "(3, 4)",
        "'f4'",
        "[0, 1]",
        "0, 1",
        "mode='wrap'",
        "a",
        "b",
        "a, a",
    ]
    starts = ["np.arange(12.0)", "np.zeros((3, 4))", "np.array([b'a', b'bc'])", "np.array([1, None], 'O')"]
    programs = []
    for _ in range(repeated(test=300, soak=10_000)):
        start = draw.choice(starts)
        objects = start is starts[-1]  # which, once it contains itself, is printed until the stack is full
        lines = ["import numpy as np", f"a = {start}", "b = a[::2]"]
        for _ in range(8):
            call = f"{draw.choice('ab')}.{draw.choice(methods)}"
            given = draw.choice(arguments[:-3] if objects else arguments)
            line = f"{call}({given})" if draw.random() < 0.9 else call
            lines += [
                "try:",
                f"    {draw.choice('abc')} = {line}",
                "except Exception:",
                "    pass",
                "str(a), str(b)",
            ]
        programs.append("\n".join(lines))
        judge(tmp_path, programs[-1])
    done = subprocess.run(
        [sys.executable, "-c", _RUNS],
        input="\0".join(programs),
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr[-2000:]
