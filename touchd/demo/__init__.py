"""`touchd demo`: the synthetic table through the real daemon, shown live in the terminal."""
