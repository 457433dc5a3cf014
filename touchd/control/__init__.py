"""Talking to a running daemon through a socket."""
