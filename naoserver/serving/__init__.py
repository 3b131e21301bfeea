"""A robot as a server: its servants, one a module, each of one interface, and what puts them together.

The interfaces (`interfaces/*.idl`) describe the operations. An operation that raises has commanded nothing.
"""
