"""Compile Slice interfaces and automaton documents into typed Python.

The command `codegen FILES...` chooses one of two compilers by the extension of each file:

- `codegen._idl.compile_interfaces` reads `*.idl` and `*.ice`;
- `codegen.hfsm.compile_document(path, output, diagnostics)` reads one `*.xml` and returns the
  generated files, next to the document or in the directory `output`.

Both report to a `codegen.diagnostics.Diagnostics` and write no file. The command writes everything that they
return, or nothing if there was an error (`codegen.files`). `codegen.command` is the command; it shares
`codegen.options` with `visualhfsm`.
"""

from __future__ import annotations
