"""The system calls that a contained process is refused, as a filter of the Linux kernel (seccomp).

It has no network and sees few files anyway. The filter refuses what would start processes, take memory that
no other limit counts, or reach parts of the kernel that no behavior needs.
"""

from __future__ import annotations

import errno
import platform
import struct
from typing import Final, NamedTuple

from visualhfsm_classes._errors import SandboxUnavailable

_LOAD: Final = 0x20  # load a word of the data about the call
_AND: Final = 0x54
_IF_EQUAL: Final = 0x15
_IF_AT_LEAST: Final = 0x35
_RETURN: Final = 0x06
_NUMBER, _ARCHITECTURE, _FIRST_ARGUMENT = 0, 4, 16
_ALLOW: Final = 0x7FFF0000
_FAIL: Final = 0x00050000
_KILL: Final = 0x80000000
_THREAD: Final = 0x00010000
"""CLONE_THREAD: the new task is a thread of its process."""
_X32: Final = 0x40000000
"""The numbers of x86-64's second set of calls begin here."""


class _Machine(NamedTuple):
    architecture: int
    """AUDIT_ARCH of the kernel."""
    clone: int
    clone3: int
    refused: tuple[int, ...]


# The numbers are those of the kernel's tables: arch/x86/entry/syscalls, include/uapi/asm-generic/unistd.h.
_NEW_ON_ALL: Final = (
    *(425, 426, 427),  # io_uring
    *(428, 429, 430, 431, 432, 433, 442),  # mounts
    *(434, 438, 447),  # pidfd_open, pidfd_getfd, memfd_secret
)
_MACHINES: Final = {
    "x86_64": _Machine(
        0xC000003E,
        56,
        435,
        (
            *(57, 58),  # fork, vfork
            *(101, 310, 311, 312),  # ptrace, process_vm_readv, process_vm_writev, kcmp
            *(41, 53),  # socket, socketpair
            *(29, 64, 68, 240, 319),  # shmget, semget, msgget, mq_open, memfd_create
            *(155, 161, 165, 166, 272, 308),  # pivot_root, chroot, mount, umount2, unshare, setns
            *(248, 249, 250),  # keys
            *(135, 298, 303, 304, 321, 323),  # personality, perf, handles of files, bpf, userfaultfd
            *(175, 246, 313),  # modules, kexec_load
            *(285, 73, 154),  # fallocate, flock, modify_ldt
            *(253, 254, 294, 300),  # inotify, fanotify
            *_NEW_ON_ALL,
        ),
    ),
    "aarch64": _Machine(
        0xC00000B7,
        220,
        435,
        (
            *(117, 270, 271, 272),
            *(198, 199),
            *(180, 186, 190, 194, 279),
            *(39, 40, 41, 51, 97, 268),
            *(217, 218, 219),
            *(92, 241, 264, 265, 280, 282),
            *(104, 105, 273),
            *(47, 32),
            *(26, 27, 262),
            *_NEW_ON_ALL,
        ),
    ),
}


def make_filter(machine: str = "") -> bytes:
    """Return the filter for a kind of computer, by default this one. Raises SandboxUnavailable."""
    machine = machine or platform.machine()
    known = _MACHINES.get(machine)
    if known is None:
        raise SandboxUnavailable.because(
            "there is no filter of system calls for a computer of the kind {machine}: grade on "
            "one of {machines}",
            machine=machine,
            machines=", ".join(_MACHINES),
        )
    refuse = _step(_RETURN, _FAIL | errno.EPERM)
    program = [
        _step(_LOAD, _ARCHITECTURE),
        _step(_IF_EQUAL, known.architecture, 1, 0),
        _step(_RETURN, _KILL),
        _step(_LOAD, _NUMBER),
        _step(_IF_AT_LEAST, _X32, 0, 1),
        refuse,
        # The C library tries clone3 first, whose flags no filter can read, and then clone.
        _step(_IF_EQUAL, known.clone3, 0, 1),
        _step(_RETURN, _FAIL | errno.ENOSYS),
        _step(_IF_EQUAL, known.clone, 0, 5),  # from here on to its refusal
        _step(_LOAD, _FIRST_ARGUMENT),
        _step(_AND, _THREAD),
        _step(_IF_EQUAL, _THREAD, 0, 1),
        _step(_RETURN, _ALLOW),
        refuse,
    ]
    for number in known.refused:
        program += [_step(_IF_EQUAL, number, 0, 1), refuse]
    return b"".join([*program, _step(_RETURN, _ALLOW)])


def _step(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    """Return an instruction; the jumps are numbers of instructions to pass over."""
    return struct.pack("=HBBI", code, if_true, if_false, value)
