"""The geometry of pictures of automata: what `visualhfsm._drawing.svg` draws without a browser.

`arcs` are the lines of transitions, `labels` the places of their names, `text` fits names into circles, and
`symbols` has glyphs and colours. All of them agree with modules of the page, in `_editor/static/canvas/` and
`_editor/static/measures/`: a change of one needs the same change of the other, and tests compare both.
"""
