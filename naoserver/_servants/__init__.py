"""The servants of a robot server, one a module: each serves one interface of a device.

The interfaces (`interfaces/*.idl`) describe the operations. An operation that raises has commanded nothing.
"""
