"""A robot as a server: its servants, each of one interface, and what puts them together.

The interfaces (`interfaces/*.idl`) describe the operations. An operation that raises has commanded nothing.

`assembly` puts the servants in front of the parts of a robot (docs/reference/robots.md lists them), `server`
serves it, and `entrances` lets plug-ins serve it in other ways, behind the same safety checks; `lasting_walk`
renews a velocity for programs that come in there and do not.
"""
