"""Pictures of automata without a browser: simpler than the page's canvas, with its glyphs and colours.

`arcs` are the lines of transitions, `text` fits names into circles, and `symbols` has glyphs and colours.
"""
