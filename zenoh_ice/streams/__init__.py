"""Streams: publishers at the servant, readers and subscriptions at its clients."""
