"""Scenes with exact truth to measure touch methods by."""

from touchd.lab.scenes.catalogue import LAB_SCENES, LONG_SCENES, lab_scene
from touchd.lab.scenes.scene import LabScene
from touchd.lab.scenes.truth import TrueStack, TrueThing, TrueTip, TrueTouch, TruthFrame
from touchd.lab.scenes.visibility import visible_shares

__all__ = [
    "LAB_SCENES",
    "LONG_SCENES",
    "LabScene",
    "TrueStack",
    "TrueThing",
    "TrueTip",
    "TrueTouch",
    "TruthFrame",
    "lab_scene",
    "visible_shares",
]
