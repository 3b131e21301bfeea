"""A program behind walls: the documents on standard input become a component on standard output.

It is started as a file, and knows the compiler alone. Standard input has the files by name, as MessagePack.
The first argument is the name of the document, and further ones are folders with packages of interfaces.
"""

from __future__ import annotations

import resource
import sys
import tempfile
from pathlib import Path
from typing import Final

import msgspec

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document

READY: Final = b"ready\n"
"""Comes before the component: what fails earlier is no fault of the documents."""
LIMIT: Final = 60
"""s of processor time."""
LARGEST_COMPONENT: Final = 16 << 20  # bytes
_MEMORY: Final = 2 << 30
"""Bytes of address space: what strangers write may be made to take all there is."""


def main(name: str, *include: str) -> int:
    """Compile it; return 1 after errors, which standard error gets."""
    for kind, most in (
        (resource.RLIMIT_AS, _MEMORY),
        (resource.RLIMIT_CPU, LIMIT),
        (resource.RLIMIT_FSIZE, 2 * LARGEST_COMPONENT),
        (resource.RLIMIT_CORE, 0),
    ):
        resource.setrlimit(kind, (most, most))
    sys.stdout.buffer.write(READY)
    sys.stdout.buffer.flush()
    with tempfile.TemporaryDirectory() as folder:
        for file, content in msgspec.msgpack.decode(sys.stdin.buffer.read()).items():
            (Path(folder) / file).write_bytes(content)
        path = Path(folder) / name
        diagnostics = Diagnostics()
        files = compile_document(path, None, diagnostics, [Path(each) for each in include])
        if files is None:
            sys.stderr.write(diagnostics.render(outcome="").replace(f"{folder}/", ""))
            return 1
        sys.stdout.buffer.write(files[0].text.encode())
        return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
