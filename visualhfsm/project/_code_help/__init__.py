"""Help with code that is being typed: completion, parameters of calls.

All of it comes from reading code, in a separate process; no code of a document is run.
"""
