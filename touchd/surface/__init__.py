"""Learning the empty surface, and what stands above it."""
