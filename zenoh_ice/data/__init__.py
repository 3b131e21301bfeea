"""What travels: values, interfaces, exceptions, keys and status, and their forms on the wire and in files."""
