"""Edit documents of automata, without a browser.

A `session` is an open document: `commands` change it, `history` undoes them, `files` and `journal` keep it.
`fragments` go through the clipboard, `merge` and `diff` compare versions, `search` finds, `problems` tells
what is wrong where (`check_process` beside), `views` is what a page draws of it, `templates` what it begins
with, and `libraries` moves parts to files of their own. `places` names the parts of a document.
"""
