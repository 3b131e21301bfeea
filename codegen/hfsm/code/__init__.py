"""Tools for the code in a document.

`language` finds it, `former` asks a plug-in about code that is not today's Python, `text` parses it and
rejects what cannot run, and `scopes` finds its local names. `values` reads typed values and times, and
`names` creates valid names for Python. The module `analysis`, next to this package, holds the results for a
whole document.
"""
