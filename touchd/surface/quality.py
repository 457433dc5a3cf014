"""How good a calibration is, in figures and in words."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from touchd.geometry import Doubles, SurfaceMap, fit_plane
from touchd.model import Mask, Shell, Surface

_PLANE_POINTS = 20_000


@dataclass(frozen=True, slots=True)
class SurfaceReport:
    """What a calibration is worth inside the active area. Lengths in mm; NaN where nothing could be measured."""

    coverage: float  # share of the area's pixels that can see touches
    noise_mm: float  # median standard deviation over time
    near_mm: float  # median height at which the shell begins
    far_mm: float  # and ends
    flatness_mm: float  # rms distance from the best plane
    tilt_deg: float  # between the camera's axis and the surface's normal
    distance_mm: float  # from the camera to the surface along the camera's axis
    moved: float  # share of the area's pixels where something moved during calibration
    problems: tuple[str, ...]  # what is wrong and what to do about it, one sentence each

    def lines(self) -> list[str]:
        """Return the report as lines for people."""
        return [
            f"surface: {self.distance_mm:.0f} mm away, tilted {self.tilt_deg:.0f}°, flat to {self.flatness_mm:.1f} mm; "
            f"{self.coverage:.1%} of the area usable, noise {self.noise_mm:.2f} mm, "
            f"touches are looked for {self.near_mm:.1f} to {self.far_mm:.1f} mm above it",
            *(f"surface: {problem}" for problem in self.problems),
        ]


def report(surface: Surface, surface_map: SurfaceMap, shell: Shell, inside: Mask) -> SurfaceReport:
    """Return the SurfaceReport of the pixels where ``inside`` (H, W) is true: the active area."""
    usable = (shell.dmax > 0) & inside
    pixels = max(1, int(inside.sum()))
    points = surface_map.rays[usable].astype(np.float64) * surface_map.depth[usable][:, None]
    plane = fit_plane(points[:: max(1, len(points) // _PLANE_POINTS)])
    tilt, distance, flatness = np.nan, np.nan, np.nan
    if plane is not None:
        flatness = float(np.sqrt(np.mean((points @ plane.normal + plane.distance_mm) ** 2)))
        tilt = float(np.degrees(np.arccos(np.clip(-plane.normal[2], -1.0, 1.0))))
        distance = float(plane.depth_mm(np.array([0.0, 0.0, 1.0])))
    figures = SurfaceReport(
        coverage=int(usable.sum()) / pixels,
        noise_mm=_noise_mm(surface, usable),
        near_mm=_height_mm(surface, shell.dmax.astype(np.float64) - 1.0, usable),
        far_mm=_height_mm(surface, shell.dmin.astype(np.float64) + 1.0, usable),
        flatness_mm=flatness,
        tilt_deg=tilt,
        distance_mm=distance,
        moved=int((surface.moved & inside).sum()) / pixels,
        problems=(),
    )
    return replace(figures, problems=_problems_of(figures))


def _height_mm(surface: Surface, boundary: Doubles, usable: Mask) -> float:
    if not usable.any():
        return float("nan")
    table = surface.sensor.to_mm
    reference = np.clip(np.rint(surface.reference[usable]), 0, len(table) - 1).astype(int)
    heights: NDArray[np.float32] = table[reference] - table[boundary[usable].astype(int)]
    return float(np.nanmedian(heights))


def _noise_mm(surface: Surface, usable: Mask) -> float:
    if not usable.any():
        return float("nan")
    reference = np.clip(np.rint(surface.reference[usable]), 0, len(surface.sensor.step_mm) - 1).astype(int)
    mm_per_raw = surface.sensor.step_mm[reference] if surface.sensor.unit == "shift" else 1.0
    return float(np.median(surface.noise[usable] * mm_per_raw))


def _problems_of(figures: SurfaceReport) -> tuple[str, ...]:
    problems: list[str] = []
    if figures.coverage == 0.0:
        problems.append(
            "no pixel of the area can see a touch; is the camera covered, nearer than it can see, or is the area "
            "outside its picture?"
        )
    elif figures.coverage < 0.95:
        problems.append(
            f"{1 - figures.coverage:.0%} of the area is blind; look for shiny or black places, sunlight, "
            "or things nearer than the camera can see"
        )
    if figures.moved > 0.005:
        problems.append(
            f"something moved over {figures.moved:.1%} of the area during calibration, which is masked there; "
            "recalibrate with nothing above the surface"
        )
    if figures.tilt_deg > 35.0:
        problems.append(
            f"the camera looks at the surface {figures.tilt_deg:.0f}° askew; beyond 35° touches are found less well"
        )
    if figures.flatness_mm > 20.0:
        problems.append(
            f"the area is far from flat ({figures.flatness_mm:.0f} mm rms); if it should be, check that area.corners_px"
            " lies on the surface"
        )
    if figures.noise_mm > 4.0:
        problems.append(
            f"the depth is noisy ({figures.noise_mm:.1f} mm); move the camera nearer or shield it from sunlight"
        )
    return tuple(problems)
