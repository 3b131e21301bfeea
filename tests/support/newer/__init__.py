"""A newer version of the interfaces of tests/support, of which only the schema is needed."""
