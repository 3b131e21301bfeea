"""The code that people typed into a document.

`pieces` finds it, `language` tells Python from C++, `reader` parses it with `text`, `python` understands
which names it binds, `trees` makes their trees; `python2` fixes what is old. `values` reads typed values,
`literals` writes them, and `names` makes names that Python takes.
"""
