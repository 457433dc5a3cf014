"""Finding the places where something touches the surface, one frame at a time."""
