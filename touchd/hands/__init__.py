"""Who and what is over the surface: hands, the people they belong to, and things that lie there."""
