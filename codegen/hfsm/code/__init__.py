"""The code that people typed into a document.

`pieces` finds it, `language` tells Python from C++, `text` parses it, `python` understands which names it
binds, and `reader` reports what is wrong with it; `python2` fixes what is old. `analysis`, beside this
package, is what checks and model checker know of all code of a document. `values` reads typed values,
`literals` writes them, and `names` makes names that Python takes.
"""
