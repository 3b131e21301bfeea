"""Document files: read in every dialect, and written in the native format.

`schema` has the tables of the native format, with which `native` reads and `writer` writes it. `xml_tree`
parses XML and `reader` detects the dialect. `spanish` and `visualstates` translate theirs to the native
format.
"""
