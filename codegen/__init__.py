"""Compile Slice interfaces and automaton documents into typed Python.

The command `codegen FILES...` chooses one of two compilers by the extension of each file:

- `codegen._idl.compile_interfaces` reads `*.idl` and `*.ice`;
- `codegen.hfsm.compile_document(path, output, diagnostics)` reads one `*.xml` and returns the generated
  files, next to the document or in the directory `output`.

Both report to a `codegen.diagnostics.Diagnostics` and write no file. The command writes everything that they
return, or nothing if there was an error (`codegen.files`). `codegen.command` is the command; it shares
`codegen.options` with `visualhfsm`.

What is said of a document is a `Message` (`messages`), which keeps its template and its values, so that the
editor says it in the language of a page; `reasons` knows the templates of what Python says. Places are
counted in the decoded texts of a document: `_text_layout` turns them into those of the file when something is
reported. `code_marks` are the marks around people's code in a component: runtime and editor read them, and
look its lines up in the document. `logic` is what the model checker and a running component share.
"""

from __future__ import annotations
