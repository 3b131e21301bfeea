"""Code that an agent may run, and code that it may not: what reaches files, programs, or around the proxies."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.places import ROOT
from visualhfsm import Project
from visualhfsm_agent._code import require_tame
from visualhfsm_agent._limits import AgentError

_TAME = [
    "import math\nx = math.pi",
    "import numpy as np\nx = np.zeros(3).copy() + np.linalg.norm(np.ones(2))",
    "from collections import deque\nx = deque([1])",
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
    "from hfsm_runtime import source_map\nsource_map('/etc/hostname', [])",
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
