"""A project without page and network: open documents, what is known of them, and the folder that has them.

`project` is the door: it opens, recovers and closes documents of a `folder`, below its `root`. `document` is
an open document, which commands change, and its events; `version` is its state at one moment, and `analyses`
compute something of it. The page, the commands and programs in Python are faces of it.
"""
