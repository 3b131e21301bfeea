"""The choice between the carriers, for each call and each stream, in one order."""
