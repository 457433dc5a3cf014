"""Finding the active area by touching its corners."""
