"""Follow components and their robot for the page: states, values, images, the view in 3D."""
