"""Help who types code into a document: what could follow, what a call takes, what is wrong.

Everything is found out by reading code, in a process beside; no code of a document is run.
"""
