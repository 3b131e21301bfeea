"""Motions made of key frames, and the ways from posture to posture that consist of them."""
