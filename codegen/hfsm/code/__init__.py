"""Tools for the code in a document.

`language` finds it and recognizes C++, `python2` converts Python 2, `text` parses it and rejects what cannot
run, and `scopes` finds its local names. `values` reads typed values and times, and `names` creates valid
names for Python. The module `analysis`, next to this package, holds the results for a whole document.
"""
