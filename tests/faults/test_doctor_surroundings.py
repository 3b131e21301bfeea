"""What `nao doctor`, and the servers that it speaks of, say on machines that are broken in many ways.

Each machine is broken by namespaces and variables, in several ways at once: starting the command takes seconds.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import pytest

from tests.support.broken_machines import SELF, Found, broken, examined, run
from tests.support.places import ROOT

pytestmark = pytest.mark.slow

SIMULATOR: Final = [*SELF, "naoserver_sim", "--world", "empty"]
CALCULATOR: Final = [*SELF, "tests.support.calculator_server"]
ONLY_IPV6: Final = "ip link set lo up && ip addr del 127.0.0.1/8 dev lo"
FULL: Final = "mount -t tmpfs -o size=64k none full && ! head -c 90000 /dev/zero > full/file 2> /dev/null"
READ_ONLY: Final = "mount -t tmpfs -o ro none state"
NO_AVX: Final = "mount --bind cpuinfo /proc/cpuinfo"
FEW_FILES: Final = "ulimit -n 64"
OLD_PROCESSOR: Final = "import os, signal\nos.kill(os.getpid(), signal.SIGILL)\n"
ROBOT: Final = """
"$PYTHON" -P -m tests.support.calculator_server --listen 'tcp/[::1]:7447' > ready &
until grep -q ready ready; do sleep 0.1; done
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the steps take: places to mount, and packages of a user."""
    folder = tmp_path_factory.mktemp("machine")
    for name in ("full", "state", "user/mujoco", "hiding", "lacking"):
        (folder / name).mkdir(parents=True)
    (folder / "user" / "mujoco" / "__init__.py").write_text(OLD_PROCESSOR)
    (folder / "user" / "zenoh.py").write_text('raise RuntimeError("mine, too")\n')
    (folder / "hiding" / "numpy.py").write_text('raise RuntimeError("mine")\n')
    (folder / "lacking" / "mujoco.py").write_text('raise ModuleNotFoundError(name="mujoco")\n')
    (folder / "cpuinfo").write_text(
        "processor\t: 0\nflags\t\t: fpu sse sse2\n\nprocessor\t: 1\nflags\t\t: fpu avx\n"
    )
    return folder


@pytest.fixture(scope="module")
def bare(folder: Path) -> Found:
    """A machine without bubblewrap, room on the disk and IPv4, where a user's file and variables are in the way."""
    return examined(
        broken(folder, FULL, ONLY_IPV6, needs=("ip",)),
        SEARCHED="/nonexistent",
        XDG_STATE_HOME=str(folder / "full"),
        TMPDIR=str(folder / "full"),
        MUJOCO_GL="banana",
        PYTHONPATH=f"{ROOT}{os.pathsep}{folder / 'hiding'}",
    )


@pytest.fixture(scope="module")
def locked(folder: Path) -> Found:
    """An old computer on which next to nothing is allowed, and whose network is down."""
    return examined(
        broken(folder, READ_ONLY, NO_AVX, FEW_FILES),
        XDG_STATE_HOME=str(folder / "state"),
        PYTHONPATH=f"{ROOT}{os.pathsep}{folder / 'user'}",
    )


def test_a_full_disk_on_which_no_stop_can_be_kept(bare: Found, folder: Path) -> None:
    line = bare.having("no emergency stop can be kept")
    place = folder / "full" / "visualhfsm" / "robots"
    assert line.startswith(
        f"FAIL no emergency stop can be kept in {place}, so that no robot server starts: No space"
    )
    assert "make room there, or set XDG_STATE_HOME" in line


def test_a_folder_that_cannot_be_written_in_which_no_stop_can_be_kept(locked: Found, folder: Path) -> None:
    line = locked.having("no emergency stop can be kept")
    assert (
        f"in {folder / 'state' / 'visualhfsm' / 'robots'}, so that no robot server starts: Read-only" in line
    )
    assert "make it yours, or set XDG_STATE_HOME" in line


def test_temporary_files_that_are_elsewhere(bare: Found, folder: Path) -> None:
    line = bare.having("TMPDIR=")
    assert line.startswith(
        f"warn TMPDIR={folder / 'full'}: nothing can be written there, so temporary files are in /"
    )


def test_a_machine_without_ipv4_has_another_endpoint(bare: Found) -> None:
    assert bare.having("this machine has no address 127.0.0.1, only IPv6").startswith("note ")
    line = bare.having("nothing listens at tcp/127.0.0.1:7447")
    assert line.startswith("FAIL ")
    assert "naoserver-sim --listen 'tcp/[::1]:7447'" in line


def test_a_machine_whose_own_network_is_down(locked: Found) -> None:
    line = locked.having("neither the address 127.0.0.1 nor ::1")
    assert line.startswith("FAIL ")
    assert line.endswith("| sudo ip link set lo up")


def test_few_files(locked: Found) -> None:
    assert locked.having("may open only 64 files").startswith("warn ")


def test_a_gl_library_that_there_is_not(bare: Found) -> None:
    line = bare.having("MUJOCO_GL=banana")
    assert line.startswith("FAIL MUJOCO_GL=banana: MuJoCo has no such choice")
    assert line.endswith("| unset MUJOCO_GL")


def test_a_file_that_hides_numpy(bare: Found, folder: Path) -> None:
    line = bare.having("hides the package numpy")
    assert line.startswith(f"FAIL {folder / 'hiding' / 'numpy.py'} hides the package numpy")
    assert "apt-get" not in bare.having("the simulator cannot be loaded: RuntimeError: mine")


def test_a_file_that_hides_zenoh_is_named_before_it_does_harm(locked: Found, folder: Path) -> None:
    assert locked.having("hides the package zenoh").startswith(f"FAIL {folder / 'user' / 'zenoh.py'} hides ")
    assert locked.having("mine, too").startswith("FAIL not checked: RuntimeError: mine, too")


def test_a_processor_without_avx_is_named(locked: Found) -> None:
    line = locked.having("the simulator cannot be loaded")
    assert line.startswith("FAIL the simulator cannot be loaded, it ends by SIGILL: this processor lacks AVX")
    assert "use another computer; give a virtual machine the processor of its host" in line


def test_the_simulator_on_a_processor_without_avx_says_so(folder: Path) -> None:
    done = run([*broken(folder, NO_AVX), *SIMULATOR], PYTHONPATH=f"{ROOT}{os.pathsep}{folder / 'user'}")
    assert done.returncode == 1, done
    assert done.stderr.startswith(
        "naoserver-sim: error: this processor lacks AVX, which MuJoCo needs: use another"
    )


def test_what_else_keeps_mujoco_from_loading_is_not_put_down_to_the_processor(folder: Path) -> None:
    """It may have been built for it, too."""
    done = run([*broken(folder, NO_AVX), *SIMULATOR], PYTHONPATH=f"{ROOT}{os.pathsep}{folder / 'lacking'}")
    assert done.stderr.startswith("naoserver-sim: error: mujoco is not installed"), done


@pytest.mark.gl
def test_a_robot_on_a_machine_without_ipv4_is_in_order(folder: Path, tmp_path: Path) -> None:
    machine = broken(folder, ONLY_IPV6, then=ROBOT, needs=("ip",))
    variables = {"MUJOCO_GL": "glfw", "XDG_STATE_HOME": str(tmp_path), "DISPLAY": ""}
    found = examined(machine, "--connect", "tcp/[::1]:7447", "--clock", "wall", **variables)
    assert found.code == 0, found
    assert found.having("answers through its local socket").startswith("ok ")
    # Nor is there a display.
    assert found.having("MUJOCO_GL=glfw").startswith(
        "note MUJOCO_GL=glfw: the simulated cameras render without a window"
    )
    assert found.having("GL renders").startswith("ok ")


def test_a_server_on_a_machine_without_ipv4_names_the_other_endpoint(folder: Path) -> None:
    machine = broken(folder, ONLY_IPV6, needs=("ip",))
    done = run([*machine, *CALCULATOR, "--listen", "tcp/127.0.0.1:7447"])
    assert "this machine does not have the address of tcp/127.0.0.1:7447" in done.stderr
    assert "--listen 'tcp/[::1]:7447', as it has only IPv6" in done.stderr
