"""Documents as files: read in every dialect in which they were ever written, and written in the native one.

`reader` finds the dialect of a document and reads it: `native`, `spanish` or `visualstates`, which share
`elements`, make the model of what `xml_tree` has parsed. `writer` writes the native dialect.
"""
