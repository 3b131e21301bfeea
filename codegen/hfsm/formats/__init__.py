"""Documents as files: read in every dialect in which they were ever written, and written in the native one.

`schema` has the tables of the native format, by which `native` reads it and `writer` writes it. `reader`
finds the dialect of a document that `xml_tree` has parsed. `spanish` and `visualstates` translate theirs.
"""
