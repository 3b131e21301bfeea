"""The contract between components: Slice definitions and the Python generated from them."""
