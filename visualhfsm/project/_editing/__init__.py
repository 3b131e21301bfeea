"""Open documents: each has undo, a file, and a journal that outlives a crash.

`edited_document` has one, which commands change step by step; `files` and `journal` keep it on disk, and
`merge` merges it with changes of another program. A new document starts from one of the `templates`, and
`imports` moves parts to separate files.
"""
