"""Readers and writers of depth recordings."""
