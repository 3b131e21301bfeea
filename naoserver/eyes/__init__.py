"""Eyes that see in pictures, with OpenCV: `pictures.py`; what they look for: `looks.py`, `eyes.toml`."""
