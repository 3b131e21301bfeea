"""Open documents: each has undo, a file, and a journal that outlives a crash.

`session` is an open document: commands change it, step by step, `files` and `journal` keep it on
disk, and `merge` brings it together with what another program wrote. A new document begins with one of the
`templates`, and `imports` moves parts to files of their own.
"""
