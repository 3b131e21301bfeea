"""Hostile inputs for the Slice compiler, always the same for a seed."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path

from codegen._idl import compile_interfaces
from codegen.diagnostics import Diagnostics

from .slice_cases import all_cases

_INTERFACES = Path(__file__).parents[2] / "interfaces"
_WORDS = r"""
module struct class interface exception enum sequence dictionary const idempotent out throws extends optional local
implements int string bool byte double void Object Value LocalObject true false m S T E I a b c \module
{ } { } ( ) [ ] [[ ]] < > , ; ; ; : :: = * # " ' \ / /* */ // /** + -
0 1 -5 0x1F 017 1.5 1e400 99999999999999999999 "text" "\n" "\xff" ["stream"] optional(1)
#if #ifdef #else #endif #define #include #undef #pragma
""".split()  # noqa: SIM905 - a list of words is easier to read than of literals


class Fuzzer:
    """Generates inputs: sets of files by name, of which `main.ice` is compiled."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._seeds = [path.read_bytes() for path in sorted(_INTERFACES.glob("*.idl"))]
        self._seeds += [case.files["main.ice"].encode() for case in all_cases()]
        self._makers: list[Callable[[], bytes]] = [
            self._truncated,
            self._damaged,
            self._damaged,
            self._spliced,
            self._words,
            self._words,
            self._bytes,
            self._nested,
            self._huge,
            self._recoded,
        ]

    def next_input(self) -> dict[str, bytes]:
        """Return another set of files."""
        files = {"main.ice": self._random.choice(self._makers)()}
        if self._random.random() < 0.1:
            files["a.ice"] = self._random.choice(self._makers)()
            include = self._random.choice(['"a.ice"', "<a.ice>", '"main.ice"', '"none.ice"', '"."', '"a.ice'])
            files["main.ice"] = f"#include {include}\n".encode() + files["main.ice"]
            if self._random.random() < 0.5:
                files["a.ice"] = b'#include "main.ice"\n' + files["a.ice"]
        return files

    def _seed(self) -> bytes:
        return self._random.choice(self._seeds)

    def _truncated(self) -> bytes:
        seed = self._seed()
        return seed[: self._random.randint(0, len(seed))]

    def _damaged(self) -> bytes:
        content = bytearray(self._seed())
        for _ in range(self._random.randint(1, 6)):
            begin = self._random.randint(0, len(content))
            end = min(len(content), begin + self._random.choice([0, 0, 1, 1, 2, 5, 20]))
            word = self._random.choice([b"", self._random.choice(_WORDS).encode(), self._random.randbytes(1)])
            content[begin:end] = word
        return bytes(content)

    def _spliced(self) -> bytes:
        first, second = self._seed(), self._seed()
        return first[: self._random.randint(0, len(first))] + second[self._random.randint(0, len(second)) :]

    def _words(self) -> bytes:
        count = self._random.randint(0, 80)
        separators = [" ", " ", " ", "\n", ""]
        parts = [self._random.choice(_WORDS) + self._random.choice(separators) for _ in range(count)]
        return "".join(parts).encode()

    def _bytes(self) -> bytes:
        return self._random.randbytes(self._random.randint(0, 300))

    def _nested(self) -> bytes:
        depth = self._random.choice([10, 60, 1000, 5000])
        opening, closing = self._random.choice(
            [
                ("module m { ", "};"),
                ("sequence<", "> a;"),
                ("{", "}"),
                ("(", ")"),
                ("[", "]"),
                ("#if 1\n", "#endif\n"),
                ("#if (", ")\n#endif"),
                ("struct S { ", "};"),
                ("interface I { void f(", "); };"),
                ("::a", ""),
                ("a::", ""),
                ("/*", "*/"),
                ("#define A A A\nA ", ""),
                ("\\", ""),
                ('"a" ', ""),
                ("!", ""),
                ("#if " + "1 ? " * 30, ""),
            ]
        )
        return (opening * depth + closing * self._random.choice([0, depth])).encode()

    def _huge(self) -> bytes:
        size = self._random.choice([500, 5000, 50_000])
        texts = [
            f"module m {{ const int a = {'9' * size}; }};",
            f"module m {{ const double a = 1.{'3' * size}e{'9' * (size // 10)}; }};",
            f'module m {{ const string a = "{"x" * size}"; }};',
            f'module m {{ const string a = "{chr(92)}u0041{chr(92)}q{chr(92)}777" ; }};' * 20,
            f"module m {{ struct {'S' * size} {{ int a; }}; }};",
            f"module m {{ enum E {{ {', '.join(f'e{number}' for number in range(size // 10))} }}; }};",
            "module m { " + "struct S { Unknown a; }; " * (size // 50) + "};",
            "".join(f"#define A{n} A{n - 1} A{n - 1}\n" for n in range(1, 40)) + "A39",
            "".join(f"#define A{n} A{n - 1}\n" for n in range(1, size // 20)) + f"A{size // 20 - 1}",
            "#define F(x) x x\n" + "F(" * 30 + "a" + ")" * 30,
            "$" * size,
            "\n" * size + "}",
            "module m { interface I0 { void f(); }; "
            + " ".join(f"interface I{n} extends I{n - 1} {{ }};" for n in range(1, size // 50))
            + " };",
        ]
        return self._random.choice(texts).encode()

    def _recoded(self) -> bytes:
        text = self._seed().decode()
        encoding = self._random.choice(
            ["utf-16", "utf-16-le", "utf-32", "latin-1", "cp1252", "utf-8-sig", "utf-7"]
        )
        recoded = text.encode(encoding, errors="replace")
        if self._random.random() < 0.3:
            recoded = recoded.replace(b"\n", self._random.choice([b"\r\n", b"\r", b"\x0b", b"\x00"]))
        return recoded


def examine(files: dict[str, bytes], directory: Path) -> bool:
    """Compile an input in a directory; return whether it was accepted.

    Raises AssertionError when it is refused without a reason that has a place, or when what is made of it is
    not Python.
    """
    for name, content in files.items():
        (directory / name).write_bytes(content)
    diagnostics = Diagnostics()
    compilation = compile_interfaces([directory / "main.ice"], [], directory / "out", diagnostics)
    for name in files:
        (directory / name).unlink()
    for found in diagnostics.errors:
        assert found.message
        assert found.location.line > 0
    assert diagnostics.render() or not diagnostics.has_errors
    for file in compilation.files:
        if file.path.suffix == ".py":
            compile(file.text, str(file.path), "exec")
    return not diagnostics.has_errors
