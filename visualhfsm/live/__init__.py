"""Follow components and their robot for the page: what they do and did, pictures, the view in 3D."""
