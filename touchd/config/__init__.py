"""The config file: its keys, reading it, and telling people what is wrong with it."""
