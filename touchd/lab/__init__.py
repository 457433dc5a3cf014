"""Measuring touchd: its speed and its accuracy."""
