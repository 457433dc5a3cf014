"""Finding fingertips: places along outlines, a model of a fingertip fitted to each, and a judge of what touches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import atan2, ceil, hypot, log, pi

import cv2
import numpy as np

from touchd.contacts.aim import heading
from touchd.contacts.belief import Belief, Beliefs
from touchd.contacts.candidates import Walk, find_ends
from touchd.contacts.company import Standing
from touchd.contacts.fit import Fitter, Picture, Quality
from touchd.contacts.heights import Heights, as_floats
from touchd.contacts.judge import Opinion, learned_judge
from touchd.contacts.memory import Memory
from touchd.contacts.method import Expected, Place, Sighting
from touchd.contacts.neighbours import close, distinct, owned_samples
from touchd.contacts.patch import PatchBank, make_bank
from touchd.contacts.recurrent import Said, learned_weights
from touchd.contacts.starts import Starts
from touchd.contacts.steady import Seen, Steady
from touchd.contacts.things import Things
from touchd.contacts.tips import Tip
from touchd.contacts.traits import traits
from touchd.contacts.unseen import UnseenTouches
from touchd.geometry import AreaMap
from touchd.model import Contact, Floats, Image16, SurfaceRows, Unseen

# Outlines are drawn at two heights, each grown by so many raw steps.
_LEVELS_MM, _LEVELS_STEPS = (5.0, 10.0), (0.4, 0.9)
_SAME_TIP_MM = 10.0  # no two fingertips are nearer
_FREE_ROUNDS, _SETTLING_ROUNDS = 1, 2
_SHOWN_RANK = 100.0  # a tip that the picture shows goes before one that was only expected
_SCALE_RATIO = 1.12  # of neighbouring pixel sizes that templates are made for
# Log odds of touching from which on a touch begins, down to which it lasts, and below which it is over at once.
_BEGINS, _LASTS, _OVER = 1.8, -1.2, -2.8
# It is over at once below the first of these, too, if it is seen to be a fingertip that had moved less than the others
# (in mm and raw steps, for the noise) from one picture to the next: the odds of one on its way waver.
_LIFTED = -1.4
_STILL_MM, _STILL_STEPS = 6.0, 1.0
_FINGER = 0.0  # log odds of being a fingertip at all, from which on it is taken for one
# No two touches are nearer, however far the sensor blurs what it sees; in raw steps, the farther the more.
_ALONE_MM, _ALONE_STEPS = 10.0, 1.0
_BELIEVED = 0.7  # what beliefs count in a height, where the judge has the rest
_SEEN_AT_ALL = 0.25  # share of the samples that are the finger's own


@dataclass(frozen=True, slots=True)
class Found:
    """The fingertips near the surface in one picture, touching or not.

    ``tips``: as they were fitted freely; ``resting``: the same, fitted as if they touched, which tells where better.
    ``traits`` (N, T): what they are judged by. ``picture``: what they were fitted to.
    """

    tips: list[Tip]
    resting: list[Tip]
    quality: Quality
    traits: Floats
    picture: Picture


class FingertipMethod:
    """Finds fingertips over one surface and decides which of them touch."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._heights = Heights(place.surface, place.surface_map, place.inside)
        sizes_mm = self._heights.sizes_mm()
        pixel_mm, step_mm = (float(np.median(sizes)) if sizes.size else 1.0 for sizes in sizes_mm)
        levels_mm = tuple(mm + steps * step_mm for mm, steps in zip(_LEVELS_MM, _LEVELS_STEPS, strict=True))
        self._step_mm = step_mm
        self._same_tip_px = _SAME_TIP_MM / pixel_mm
        self._memory = Memory()
        self._judge = learned_judge()
        self._pixel_mm = pixel_mm
        self._beliefs = Beliefs(pixel_mm, learned_weights())
        self._steady = Steady(step_mm)
        self._things = Things(self._heights, levels_mm, step_mm)
        self._fitter = Fitter(_bank_for(sizes_mm, self._heights.steepest_lean(), place))
        self._walk = _walk_for(pixel_mm, place.surface.sensor.fatten_px)
        ahead_px = [self._fitter.reach_mm(pixel_mm, level) / pixel_mm for level in levels_mm]
        self._starts = Starts(self._heights, place, ahead_px, pixel_mm)
        self._unseen_touches = UnseenTouches(self._heights, pixel_mm, step_mm)

    def find(self, raw: Image16, expected: Sequence[Expected]) -> Sighting:
        """Return the touching fingertips in one picture (H, W) uint16, and where others hover."""
        found = self.look(raw, expected)
        if found is None:
            self._steady = Steady(self._step_mm)
            self._beliefs.update([])
            return Sighting([], unseen=self._unseen(raw, expected))
        opinions = self._judge.opinions(found.traits) if found.tips else []
        # What went astray is begun anew in the next picture, lest it wander on.
        self._memory.keep([tip for tip, said in zip(found.tips, opinions, strict=True) if said.finger_odds > _FINGER])
        seen = [one for one in self._steady.settle(_sightings(found, opinions), found.picture) if self._is_sure(one)]
        standing = [self._standing(one) for one in seen]
        beliefs = self._beliefs.update(standing)
        sighting = Sighting([], [place_mm for belief in beliefs if (place_mm := self._lifted_mm(belief)) is not None])
        for one, said in self._apart(standing, [belief.said for belief in beliefs]):
            self._tell(one, said, sighting)
        if len(sighting.contacts) < len(expected):
            return replace(sighting, unseen=self._unseen(raw, expected))
        return sighting

    def follow(self, now: SurfaceRows) -> None:
        """Take some rows of the surface to read differently from now on."""
        self._heights.follow(now)
        self._things.follow(now.rows)

    def relocate(self, area: AreaMap) -> None:
        """Take the area to lie so from now on."""
        self._place = replace(self._place, area=area)
        self._starts.relocate(area)

    def look(self, raw: Image16, expected: Sequence[Expected]) -> Found | None:
        """Return all fingertips near the surface, touching or not; None where nothing stands above it."""
        box = self._things.busy(raw)
        if box is None:
            return None
        heights, readings = self._heights.over(raw, box)
        heights = as_floats(cv2.medianBlur(heights, 3))
        smooth = as_floats(cv2.blur(heights, (3, 3)))
        ends = find_ends(self._things.outlines(heights, smooth, box), smooth, self._walk)
        guesses = self._starts.guesses(ends, expected, smooth, box, self._same_tip_px)
        picture = Picture(heights, readings, box)
        if not guesses:
            return Found([], [], Quality([], [], []), np.zeros((0, 0), np.float32), picture)
        return self._fitted([self._memory.begin(guess) for guess in guesses], picture)

    def _fitted(self, tips: list[Tip], picture: Picture) -> Found:
        """Fit freely, drop what became the same tip, share the samples, and fit again; then let it rest.

        The clearance decides on touching, so it must be free; the place is surer with the clearance known.
        """
        fitter = self._fitter
        bed = fitter.bed(tips)
        left = fitter.fit(tips, bed, picture, np.ones(bed.core.shape, np.float32), _FREE_ROUNDS)
        kept = self._different(tips, left.quality)
        if len(kept) < len(tips):
            tips, bed = [tips[i] for i in kept], bed.at(kept)
        owned = owned_samples(tips, bed.places)
        fitted = fitter.fit(tips, bed, picture, owned, _SETTLING_ROUNDS)
        quality, resting = fitted.quality(), fitted.at_rest(tips)
        told = traits(tips, fitted, quality, picture)
        kept = self._different(resting, lambda: quality)
        return Found([tips[i] for i in kept], [resting[i] for i in kept], quality.at(kept), told[kept], picture)

    def _different(self, tips: list[Tip], quality: Callable[[], Quality]) -> list[int]:
        """Return which tips to keep of those that became the same one: the best fit that the picture itself showed."""
        places = [(tip.u, tip.v) for tip in tips]
        if not close(places, self._same_tip_px):
            return list(range(len(tips)))
        misfit = quality().misfit
        return distinct(
            places, [tip.guess.shown * _SHOWN_RANK - misfit[i] for i, tip in enumerate(tips)], self._same_tip_px
        )

    def _standing(self, seen: Seen) -> Standing:
        rest_mm, under_mm = self._place_mm(seen.u, seen.v), self._place_mm(seen.u_under, seen.v_under)
        back_u, back_v = seen.lay.along(seen.angle)
        back_x_mm, back_y_mm = self._place_mm(seen.u + back_u, seen.v + back_v)
        way = hypot(rest_mm[0] - back_x_mm, rest_mm[1] - back_y_mm)
        return Standing(seen, rest_mm, under_mm, ((rest_mm[0] - back_x_mm) / way, (rest_mm[1] - back_y_mm) / way))

    def _apart(self, standing: Sequence[Standing], said: Sequence[Said]) -> list[tuple[Standing, Said]]:
        """Return those that touch the most likely of any that are too near to each other to be two fingers."""
        apart_mm = _ALONE_MM + _ALONE_STEPS * self._step_mm
        kept = distinct([one.rest_mm for one in standing], [each.odds for each in said], apart_mm)
        return [(standing[i], said[i]) for i in kept]

    def _lifted_mm(self, belief: Belief) -> tuple[float, float] | None:
        """Return where a fingertip was before it lifted: the higher it is, the farther off it may be seen by now."""
        said, before = belief.said, belief.before
        if before is None or said.odds > _LIFTED or said.finger_odds < _FINGER:
            return None
        kept_still = hypot(*before.way_px) * self._pixel_mm < _STILL_MM + _STILL_STEPS * self._step_mm
        return before.standing.rest_mm if kept_still else None

    def _unseen(self, raw: Image16, expected: Sequence[Expected]) -> Unseen:
        return self._unseen_touches.among(raw, [self._starts.place_px(x_mm, y_mm) for x_mm, y_mm in expected])

    def _tell(self, one: Standing, said: Said, sighting: Sighting) -> None:
        """Add one fingertip to what is said of the picture."""
        if said.odds < _LASTS:
            if one.seen.shown and said.finger_odds > 0.0:
                sighting.hovers.append(self._contact(one, one.under_mm, said, firm=False))
        else:
            firm = said.odds > _BEGINS and one.seen.shown
            sighting.contacts.append(self._contact(one, one.from_rest_mm(said.along_mm, said.across_mm), said, firm))
        if said.odds < _OVER:
            sighting.lifted_mm.append(one.rest_mm)

    def _contact(self, one: Standing, place_mm: tuple[float, float], said: Said, firm: bool) -> Contact:
        width_mm, height_mm = self._place.area.size_mm
        return Contact(
            x=place_mm[0] / width_mm,
            y=place_mm[1] / height_mm,
            x_mm=place_mm[0],
            y_mm=place_mm[1],
            # Each errs where the other does not: the judge far up, beliefs low down.
            height_mm=max(0.0, _BELIEVED * said.clearance_mm + (1.0 - _BELIEVED) * one.seen.clearance_mm),
            area_mm2=pi * one.seen.radius_mm**2,
            angle=_half_turn(atan2(one.towards[1], one.towards[0])),
            firm=firm,
            towards=one.towards,
        )

    def _place_mm(self, u: float, v: float) -> tuple[float, float]:
        x, y = self.area_of(u, v)
        width_mm, height_mm = self._place.area.size_mm
        return x * width_mm, y * height_mm

    def _is_sure(self, seen: Seen) -> bool:
        """Return whether the surface is known well where a fingertip is seen."""
        sure = self._heights.sure
        column, row = round(seen.u), round(seen.v)
        return 0 <= row < sure.shape[0] and 0 <= column < sure.shape[1] and bool(sure[row, column])

    def area_of(self, u: float, v: float) -> tuple[float, float]:
        """Return the area coordinates of what is seen at a pixel, through the lens."""
        surface = self._place.surface_map
        rows, columns = surface.depth.shape
        column, row = min(max(round(u), 0), columns - 1), min(max(round(v), 0), rows - 1)
        ray_x, ray_y, _ = surface.rays[row, column].tolist()
        ray_x += (u - column) * surface.pitch[0]
        ray_y += (v - row) * surface.pitch[1]
        return self._place.area.of_point(ray_x, ray_y, 1.0)


def _sightings(found: Found, opinions: Sequence[Opinion]) -> list[Seen]:
    """Return what was found of each fingertip that is seen at all."""
    return [
        _sighting(tip, resting, opinion)
        for tip, resting, opinion, share in zip(found.tips, found.resting, opinions, found.quality.seen, strict=True)
        if share >= _SEEN_AT_ALL
    ]


def _sighting(tip: Tip, resting: Tip, opinion: Opinion) -> Seen:
    lay, (u, v) = tip.guess.lay, resting.foot_px
    along_u, along_v = lay.along(resting.angle)
    across_u, across_v = lay.along(resting.angle + pi / 2)
    return Seen(
        u + along_u * opinion.along_mm + across_u * opinion.across_mm,
        v + along_v * opinion.along_mm + across_v * opinion.across_mm,
        *tip.under_px,
        heading(resting.angle, tip.pitch_rad, (lay.x_by_z, lay.y_by_z)),
        tip.radius_mm,
        opinion.clearance_mm,
        opinion.odds,
        opinion.finger_odds,
        tip.guess.shown,
        lay,
        opinion,
    )


def _walk_for(pixel_mm: float, fatten_px: float) -> Walk:
    """Return how to look at outlines whose fingers are 13 mm thick and grown by the sensor's window."""
    width_px = 13.0 / pixel_mm + 1.5 * fatten_px
    return Walk(
        reaches=(max(4, int(0.8 * width_px)), max(6, int(1.5 * width_px))),
        inset=6.0 / pixel_mm + 0.25 * fatten_px,
        lowest_mm=26.0,
    )


def _bank_for(sizes_mm: tuple[Floats, Floats], steepest_lean: float, place: Place) -> PatchBank:
    """Return templates for all sizes that a pixel has on the usable surface, given with those of the raw steps."""
    pixel_mm, step_mm = sizes_mm if sizes_mm[0].size else (np.ones(1, np.float32), np.ones(1, np.float32))
    low, high = np.quantile(pixel_mm, [0.01, 0.99]).tolist()
    count = max(1, ceil(log(high / low) / log(_SCALE_RATIO)))
    scales = np.geomspace(low, high, 2 * count + 1)[1::2].astype(np.float32)
    order = np.argsort(pixel_mm, kind="stable")
    steps = np.interp(scales, pixel_mm[order], step_mm[order]).astype(np.float32)
    return make_bank(place.surface.sensor, scales, steps, steepest_lean)


def _half_turn(angle: float) -> float:
    """Return the same undirected line's angle in (−π/2, π/2]."""
    return pi / 2 - (pi / 2 - angle) % pi
