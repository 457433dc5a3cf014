"""Settings of the tracking stage; ``config`` builds them from the YAML file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TrackingSettings:
    """How contacts are followed. Lifetimes are in time, never in frames; distances on the table, in mm.

    ``stall_ms``: without a frame for this long all touches end (the worker's business, kept here with the rest).
    ``coast_ms``: how long a touch outlives its contact. ``gate_mm``: farthest a contact may lie from where its touch
    was expected, at 30 Hz; for one that moves, half the way farther that it goes in a frame. ``stray_mm``: how far
    outside the area a touch may slide before it ends. ``min_cutoff_hz``, ``beta_hz_s_mm``: the one-euro filter's cutoff
    at rest, and its rise with speed. ``hover_mm``: fingertips up to this height over the surface are followed as
    hovers; at 0 there are none. ``rest_mm_s``: below this speed a touch is at rest and its velocity is exactly zero.
    """

    stall_ms: float = 150.0
    coast_ms: float = 50.0
    gate_mm: float = 30.0
    stray_mm: float = 5.0
    min_cutoff_hz: float = 1.5
    beta_hz_s_mm: float = 0.1
    rest_mm_s: float = 5.0
    hover_mm: float = 40.0
