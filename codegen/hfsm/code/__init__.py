"""The code that people typed into a document.

`language` finds it and recognizes C++, `python2` fixes what is old, `text` parses it and refuses what
cannot run, and `scopes` knows which names are local to it. `values` reads typed values and times, and `names`
makes names that Python takes. `analysis`, beside this package, is what the tools share of all code.
"""
