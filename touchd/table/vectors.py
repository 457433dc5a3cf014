"""Arithmetic on points and directions in space, for the few dozen joints of a hand: quicker than arrays."""

from math import cos, hypot, radians, sin, sqrt

from touchd.table.scene import Place, Point

UP: Point = (0.0, 0.0, 1.0)


def plus(a: Point, b: Point, share: float = 1.0) -> Point:
    """Return a + share·b."""
    return (a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2])


def minus(a: Point, b: Point) -> Point:
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def times(a: Point, factor: float) -> Point:
    """Return a, longer by a factor."""
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def dot(a: Point, b: Point) -> float:
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def length(a: Point) -> float:
    """Return the length."""
    return sqrt(dot(a, a))


def unit(a: Point) -> Point:
    """Return the direction of a vector that is not zero."""
    return times(a, 1.0 / length(a))


def square_to(a: Point, direction: Point) -> Point:
    """Return the direction of what is left of ``a`` without its part along a unit vector."""
    rest = plus(a, direction, -dot(a, direction))
    if length(rest) < 1e-6:
        rest = (direction[1], -direction[0], 0.0) if abs(direction[2]) < 0.9 else (1.0, 0.0, 0.0)
    return unit(rest)


def mean(points: list[Point]) -> Point:
    """Return the middle of points."""
    total = points[0]
    for point in points[1:]:
        total = plus(total, point)
    return times(total, 1.0 / len(points))


def turned(offset: Place, heading_deg: float) -> Place:
    """Return (forward, right) in table coordinates; heading 0 points up the picture, 90 to the right."""
    heading = radians(heading_deg)
    forward, right = offset
    return (forward * sin(heading) + right * cos(heading), right * sin(heading) - forward * cos(heading))


def away(a: Place, b: Place) -> float:
    """Return the distance of two places."""
    return hypot(a[0] - b[0], a[1] - b[1])


def between(a: float, b: float, share: float) -> float:
    """Return the value a share of the way from a to b."""
    return a + share * (b - a)
