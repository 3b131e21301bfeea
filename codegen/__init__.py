"""Compile what people write for a robot into typed Python: Slice interfaces and automaton documents.

One command, `codegen FILES...`, and two compilers behind it, chosen by the file's extension:

- `codegen.idl.compile_interfaces` reads `*.idl` and `*.ice`;
- `codegen.hfsm.compile_document(path, output, diagnostics)` reads one `*.xml` and returns the
  `GeneratedFile`s it makes, beside the document or in the directory `output` when that is given.

Both report what is wrong to a `codegen.diagnostics.Diagnostics` and touch no file: the command writes all
that they return, or nothing when there was an error (`codegen.files`). `codegen.command` is the command; it
shares `codegen.options` with `visualhfsm`.
"""

from __future__ import annotations
