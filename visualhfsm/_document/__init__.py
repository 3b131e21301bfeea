"""Documents of automata as values that commands change, without a browser and without files.

`commands` change a document, `serialization` reads and writes it and its parts, `places` names them, `diff`
compares versions, `problems` finds errors and their places, and `views` is what the page draws. `nodes`,
`subtrees` and `geometry` are the parts of commands. `generate` writes the component of a document, and
`origins` maps a component's output to places in the document.
"""
