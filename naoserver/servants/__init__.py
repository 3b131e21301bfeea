"""The servants of a robot server, one a module: each serves one interface of a device."""
