"""Writes docs/accuracy.md's tables, chart and pictures from what `touchd bench accuracy --json` found."""
