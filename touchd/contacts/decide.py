"""Touching or not: what the clearance of a fitted fingertip says, and how far the fit can be believed.

The figures come from the fits of rendered fingers whose clearance is known: those that touch, hover, or are none.
"""

from dataclasses import dataclass

# A touch begins below the first and ends above the second, each grown by so many raw steps.
_ON_MM, _ON_STEPS = 2.2, 1.3
_OFF_MM, _OFF_STEPS = 3.0, 2.5
# What a fine sensor sees of steep fingers is unsteady, so that it may be higher in a single picture while a touch
# lasts: by so many mm for each rad beyond a pitch, less and less up to a coarser step.
_UNSTEADY_RAD, _UNSTEADY_MM, _FINE_UP_TO_STEP, _RAISED_MM = 1.0, 20.0, 3.0, 1.0
# A touch ends at once if it is plainly above that, else if it is so in two pictures.
_PLAIN_MM, _PLAIN_STEPS = 1.5, 0.8
# An average over many pictures errs less, so that it may be higher.
_SETTLED_MM, _SETTLED_STEPS = 1.0, 0.3
# To a coarse sensor, what looks upright is no finger.
_UPRIGHT_RAD, _UPRIGHT_MM, _UPRIGHT_FROM_STEP = 1.0, 25.0, 2.5
# A poor fit must lie lower: by so many raw steps for each standard deviation above what good fits have.
_GOOD, _CORE_STEPS, _MISFIT_STEPS = 1.0, 0.8, 3.0
_KEPT_SHARE = 0.5  # of its doubt is held against what continues a touch
_HOPELESS = 3.0  # as a residual along the finger's middle: this is no finger
_SURE_STEPS, _CLEAR_STEPS = 0.8, 1.5  # of doubt, at most, to begin a touch at first sight, and to end one
_FLAT_RAD, _THIN_MM = 0.35, -2.5
_SEEN_AT_ALL, _SEEN_WELL = 0.45, 0.6  # share of the samples that are the finger's own


@dataclass(frozen=True, slots=True)
class Fit:
    """One fitted fingertip, in plain numbers; ``seen_pitch_rad`` is its pitch towards the camera's way of looking.

    It is the average over so many ``pictures``.
    """

    pitch_rad: float
    seen_pitch_rad: float
    clearance_mm: float
    misfit: float
    core: float
    seen: float
    pictures: int = 1


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a fit says.

    ``low``: as near as when a touch begins. ``sure``: well enough seen to begin one at first sight, else it takes two.
    ``kept``: near enough to continue one. ``raised``: not so near that this could go on for a second picture.
    ``lifted``: seen well, and not touching. ``hovers``: seen well, and too high to begin a touch.
    """

    low: bool
    sure: bool
    kept: bool
    raised: bool
    lifted: bool
    hovers: bool


def verdict(fit: Fit, step_mm: float) -> Verdict:
    """Return whether a fingertip touches, where a raw step of the sensor is ``step_mm`` high."""
    if fit.seen < _SEEN_AT_ALL:
        return Verdict(low=False, sure=False, kept=False, raised=False, lifted=False, hovers=False)
    clearance_mm, doubt_mm = fit.clearance_mm, _doubt_mm(fit, step_mm)
    fine = max(0.0, _FINE_UP_TO_STEP - step_mm)
    unsteady_mm = _UNSTEADY_MM * fine * max(0.0, fit.seen_pitch_rad - _UNSTEADY_RAD)
    off_mm = _OFF_MM + _OFF_STEPS * step_mm
    on_mm = _ON_MM + _ON_STEPS * step_mm + (_SETTLED_MM + _SETTLED_STEPS * step_mm) * (1.0 - 1.0 / fit.pictures)
    finger = fit.seen > _SEEN_WELL and not _is_slab(fit)
    low, clear = clearance_mm + doubt_mm < on_mm, doubt_mm < _CLEAR_STEPS * step_mm
    return Verdict(
        low=finger and low,
        sure=doubt_mm < _SURE_STEPS * step_mm,
        kept=fit.core < _HOPELESS and clearance_mm + _KEPT_SHARE * doubt_mm < off_mm + unsteady_mm,
        raised=clearance_mm > off_mm + _RAISED_MM,
        lifted=clear and clearance_mm > off_mm + unsteady_mm + _PLAIN_MM + _PLAIN_STEPS * step_mm,
        hovers=finger and clear and not low,
    )


def _is_slab(fit: Fit) -> bool:
    """Return whether it lies flatter than fingers do and is thinner: the edge of a phone, or of a booklet."""
    return fit.pitch_rad < _FLAT_RAD and fit.clearance_mm < _THIN_MM


def _doubt_mm(fit: Fit, step_mm: float) -> float:
    """Return how much lower than a good fit one must lie to count the same."""
    poor = _CORE_STEPS * max(0.0, fit.core - _GOOD) + _MISFIT_STEPS * max(0.0, fit.misfit - _GOOD)
    upright = max(0.0, step_mm - _UPRIGHT_FROM_STEP) * max(0.0, fit.seen_pitch_rad - _UPRIGHT_RAD)
    return step_mm * poor + _UPRIGHT_MM * upright
