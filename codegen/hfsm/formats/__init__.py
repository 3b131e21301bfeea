"""Document files: read in every format that is installed, and written in ours.

`schema` has the tables of our format, with which `native` reads and `writer` writes it. `xml_tree` parses
XML, `others` finds the formats that plug-ins read, and `reader` chooses among all of them.
"""
