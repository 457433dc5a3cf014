"""Settings of things on the surface; ``config`` builds them from the YAML file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """``join_after_s``: after lying still for so long, once no hand is over or near it, a thing joins the surface."""

    join_after_s: float = 3.0
