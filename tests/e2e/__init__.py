"""Tests of whole programs; as a package, they can share one browser."""
