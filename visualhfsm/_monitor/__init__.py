"""Follow, steer, record and replay components and their robot: `realm` is the base of all views of them."""
