"""Documents as files: read in every dialect in which they were ever written, and written in the native one.

`reader` reads them with `xml_tree` and `dialects`, `writer` writes them with `xml_text`.
"""
