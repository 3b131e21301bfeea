"""Make a component of a document: understand it as a program, and write that down as Python.

`understanding` analyzes a document with `automaton_analysis` and `attributes`; `generator` writes the
component, and `automaton_writer` each automaton of it.
"""
