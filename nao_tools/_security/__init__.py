"""Certificates and settings with which robots and people on a network identify each other."""
