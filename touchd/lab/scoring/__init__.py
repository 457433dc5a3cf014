"""Scoring: what a program said of a scene against what was true. Pure; knows nothing of touchd's own methods."""

from touchd.lab.scoring.events import SeenFrame, read_events, seen_frame, seen_frames
from touchd.lab.scoring.measures import MEASURES, Measure, figures
from touchd.lab.scoring.score import Score, pooled, score
from touchd.lab.scoring.truth import HAPPENINGS_NAME, Truth, read_truth, truth_of

__all__ = [
    "HAPPENINGS_NAME",
    "MEASURES",
    "Measure",
    "Score",
    "SeenFrame",
    "Truth",
    "figures",
    "pooled",
    "read_events",
    "read_truth",
    "score",
    "seen_frame",
    "seen_frames",
    "truth_of",
]
