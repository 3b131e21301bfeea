"""Ice's objects on any transport: proxies, servants, adapters, streams, presence and the communicator."""
