"""How the daemon fares, told to people, to programs and to monitoring."""
