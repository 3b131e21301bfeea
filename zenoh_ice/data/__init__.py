"""Data that travels, on the wire and in files: values, interfaces, exceptions, keys and status."""
