"""The parts of open documents: each has undo, a file, and a journal that outlives a crash.

`document_state` has them together, and begins with a document; `undo_stack` applies commands as steps that
can be undone, each of which makes a `change`; `document_file`, `files` and `journal` keep it on disk, and
`merge` merges it with changes of another program. A new document starts from one of the `templates`, and
`imports` moves parts to separate files. `shelf` finds the ready states, ours and those of the project.
"""
