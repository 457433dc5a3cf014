"""Touching or not: what the clearance of a fitted fingertip says, and how far the fit can be believed."""

from dataclasses import dataclass

# A touch begins below the first and ends above the second, each grown by so many raw steps.
_ON_MM, _ON_STEPS = 3.5, 1.1
_OFF_MM, _OFF_STEPS = 4.5, 2.8
# A steep finger hides its tip, so that its clearance reads too high: by this much per step and radian. On a coarse
# sensor the prior on the pitch takes care of that.
_STEEP_MM, _STEEP_RAD = 13.0, 0.75
# Where the fit is doubted: between full trust and none.
_MISFIT, _MISFIT_PER_STEP, _MISFIT_SPAN = 1.6, 0.6, 0.6
_PITCH_RAD, _PITCH_PER_STEP, _PITCH_SPAN = 1.17, 0.012, 0.1
_CORE, _CORE_SPAN = 3.6, 1.2
_LEAST_SEEN = 0.45
_BEGINS, _SURE = 0.2, 0.3  # the least trust in a fit that begins a touch, and in one that ends it
_DOUBT_KEEPS = 0.35  # a live touch is given this much more trust


@dataclass(frozen=True, slots=True)
class Fit:
    """One fitted fingertip, in plain numbers."""

    pitch_rad: float
    clearance_mm: float
    misfit: float
    core: float
    seen: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a fit says.

    ``firm``: touching, surely enough to begin a touch. ``kept``: near enough to continue one. ``lifted``: seen well,
    and not touching.
    """

    clearance_mm: float
    firm: bool
    kept: bool
    lifted: bool


def verdict(fit: Fit, step_mm: float) -> Verdict:
    """Return whether a fingertip touches, where a raw step of the sensor is ``step_mm`` high.

    The thresholds shrink with the trust in the fit: a doubtful one must lie lower.
    """
    clearance_mm = fit.clearance_mm - _STEEP_MM / step_mm * max(0.0, fit.pitch_rad - _STEEP_RAD)
    trust = _trust(fit, step_mm)
    on_mm, off_mm = _ON_MM + _ON_STEPS * step_mm, _OFF_MM + _OFF_STEPS * step_mm
    return Verdict(
        clearance_mm,
        firm=trust > _BEGINS and clearance_mm < on_mm * trust,
        kept=trust > 0.0 and clearance_mm < off_mm * min(1.0, trust + _DOUBT_KEEPS),
        lifted=trust > _SURE and clearance_mm > off_mm,
    )


def _trust(fit: Fit, step_mm: float) -> float:
    """Return how far a fit can be believed, from 0 to 1."""
    if fit.seen < _LEAST_SEEN:
        return 0.0
    by_misfit = (_MISFIT + _MISFIT_PER_STEP / step_mm - fit.misfit) / _MISFIT_SPAN
    by_pitch = (_PITCH_RAD - _PITCH_PER_STEP * step_mm - fit.pitch_rad) / _PITCH_SPAN
    by_core = (_CORE - fit.core) / _CORE_SPAN
    trust = 1.0
    for part in (by_misfit, by_pitch, by_core):
        trust *= min(1.0, max(0.0, part))
    return trust
