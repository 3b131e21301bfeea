"""Eyes that see in pictures, with OpenCV: `_pictures.py`; what they look for: `looks.py`, `eyes.toml`."""
