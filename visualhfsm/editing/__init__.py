"""Documents of automata as values that commands change, without a browser and without files.

`commands` change a document, `serialization` reads and writes it and its parts, `places` names them, `diff`
compares versions, `problems` finds what is wrong where, and `views` is what a page draws of it. `nodes`,
`subtrees` and `geometry` are what commands are made of.
"""
