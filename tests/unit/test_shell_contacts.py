import numpy as np
import pytest
from touchd.contacts.locate import Locator
from touchd.contacts.settings import BlobSettings
from touchd.contacts.shell import Blob, ShellFinder
from touchd.geometry import AreaMap, kinect_v1_sensor, map_area, map_surface, raw_of_depth
from touchd.model import AreaCorners, Image16, Intrinsics, Shell, Surface
from touchd.surface.settings import ShellSettings
from touchd.surface.shell import shell_over

SENSOR = kinect_v1_sensor(intrinsics=Intrinsics(580.0, 580.0, 319.5, 239.5))
Z_MM = 800.0
MM_PER_PX = Z_MM / 580.0
EVERYWHERE = np.ones((480, 640), bool)
CORNERS = AreaCorners(((120.0, 80.0), (520.0, 80.0), (520.0, 400.0), (120.0, 400.0)))
SIZE_MM = (400 * MM_PER_PX, 320 * MM_PER_PX)


def raw_at(height_mm: float) -> int:
    return round(float(raw_of_depth(SENSOR, np.array([Z_MM - height_mm]))[0]))


def empty_picture() -> Image16:
    return np.full((480, 640), raw_at(0.0), np.uint16)


def with_block(u: int, v: int, width: int, height: int, height_mm: float, picture: Image16 | None = None) -> Image16:
    picture = empty_picture() if picture is None else picture
    picture[v : v + height, u : u + width] = raw_at(height_mm)
    return picture


@pytest.fixture(scope="module")
def surface() -> Surface:
    reference = empty_picture()
    return Surface(
        sensor=SENSOR,
        reference=reference.astype(np.float32),
        dmax=reference,
        noise=np.zeros(reference.shape, np.float32),
        valid=EVERYWHERE,
        moved=~EVERYWHERE,
        frames=1,
        made_from="a test",
    )


@pytest.fixture(scope="module")
def shell(surface: Surface) -> Shell:
    return shell_over(surface, ShellSettings(near_mm=3.0, far_mm=14.0))


@pytest.fixture(scope="module")
def finder(surface: Surface, shell: Shell) -> ShellFinder:
    return ShellFinder(surface, shell, BlobSettings(), EVERYWHERE)


@pytest.fixture(scope="module")
def area() -> AreaMap:
    return map_area(CORNERS, SENSOR.intrinsics, SIZE_MM)


@pytest.fixture(scope="module")
def locator(surface: Surface, area: AreaMap) -> Locator:
    return Locator(SENSOR, map_surface(surface), area, BlobSettings())


def test_an_empty_surface_has_no_blobs(finder: ShellFinder) -> None:
    assert finder.find(empty_picture()) == []


def test_a_block_in_the_shell_is_one_firm_blob_at_its_centre(finder: ShellFinder) -> None:
    (blob,) = finder.find(with_block(300, 200, 12, 12, 8.0))
    assert [blob.u, blob.v] == pytest.approx([305.5, 205.5])
    assert blob.peak == 1.0
    assert blob.seen_raw == raw_at(8.0)
    assert blob.surface_raw == raw_at(0.0)


@pytest.mark.parametrize("height_mm", [1.0, 18.0, 60.0])
def test_what_is_below_or_above_the_shell_is_no_blob(finder: ShellFinder, height_mm: float) -> None:
    assert finder.find(with_block(300, 200, 12, 12, height_mm)) == []


def test_a_thin_outline_in_the_shell_is_no_blob(finder: ShellFinder) -> None:
    assert finder.find(with_block(200, 200, 200, 2, 8.0)) == []


def test_two_fingers_twenty_pixels_apart_are_two_blobs(finder: ShellFinder) -> None:
    picture = with_block(300, 200, 10, 10, 8.0)
    assert len(finder.find(with_block(320, 200, 10, 10, 8.0, picture))) == 2


def test_the_long_axis_of_a_blob_is_that_of_what_is_seen(finder: ShellFinder) -> None:
    (flat,) = finder.find(with_block(300, 200, 40, 10, 8.0))
    (upright,) = finder.find(with_block(300, 200, 10, 40, 8.0))
    assert np.abs(flat.axis) == pytest.approx([1.0, 0.0], abs=1e-6)
    assert np.abs(upright.axis) == pytest.approx([0.0, 1.0], abs=1e-6)


def test_nothing_is_found_outside_the_area_and_its_margin(surface: Surface, shell: Shell) -> None:
    inside = np.zeros((480, 640), bool)
    inside[100:300, 100:300] = True
    finder = ShellFinder(surface, shell, BlobSettings(), inside)
    assert finder.find(with_block(400, 200, 12, 12, 8.0)) == []
    assert len(finder.find(with_block(200, 200, 12, 12, 8.0))) == 1


def test_with_no_usable_pixel_nothing_is_found(surface: Surface, shell: Shell) -> None:
    finder = ShellFinder(surface, shell, BlobSettings(), ~EVERYWHERE)
    assert finder.find(with_block(200, 200, 12, 12, 8.0)) == []


def test_pixels_without_a_reading_are_not_in_the_shell(finder: ShellFinder) -> None:
    picture = empty_picture()
    picture[200:260, 300:360] = SENSOR.invalid
    assert finder.find(picture) == []


def test_a_contact_is_the_foot_of_what_is_seen_in_area_coordinates(finder: ShellFinder, locator: Locator) -> None:
    (contact,) = locator.contacts(finder.find(with_block(474, 334, 12, 12, 8.0)))
    # Seen at 479.5, 339.5 a height above the surface: its foot is nearer to the picture's centre by that share of Z.
    surface_mm, seen_mm = (float(SENSOR.to_mm[raw_at(height)]) for height in (0.0, 8.0))
    u, v = 319.5 + 160.0 * seen_mm / surface_mm, 239.5 + 100.0 * seen_mm / surface_mm
    assert contact.x == pytest.approx((u - 120) / 400, abs=2e-4)
    assert contact.y == pytest.approx((v - 80) / 320, abs=2e-4)
    assert contact.x_mm == pytest.approx(contact.x * SIZE_MM[0])
    assert contact.height_mm == pytest.approx(surface_mm - seen_mm, abs=0.05)
    assert contact.firm


def test_a_contact_s_area_is_in_square_millimetres_of_the_surface(finder: ShellFinder, locator: Locator) -> None:
    (blob,) = finder.find(with_block(300, 200, 12, 12, 8.0))
    (contact,) = locator.contacts([blob])
    assert contact.area_mm2 == pytest.approx(blob.pixels * MM_PER_PX**2, rel=0.03)


def test_what_is_smaller_or_larger_than_a_finger_is_no_contact(locator: Locator) -> None:
    def blob(pixels: float) -> Blob:
        return Blob(u=320, v=240, surface_raw=raw_at(0), seen_raw=raw_at(8), pixels=pixels, axis=(1.0, 0.0), peak=1.0)

    pixel_mm2 = MM_PER_PX**2
    least, most = BlobSettings().min_area_mm2 / pixel_mm2, BlobSettings().max_area_mm2 / pixel_mm2
    assert locator.contacts([blob(least * 0.9), blob(most * 1.1)]) == []
    assert len(locator.contacts([blob(least * 1.1), blob(most * 0.9)])) == 2


def test_a_weak_blob_is_a_contact_that_is_not_firm(locator: Locator) -> None:
    weak = Blob(u=320, v=240, surface_raw=raw_at(0), seen_raw=raw_at(8), pixels=60, axis=(1.0, 0.0), peak=0.45)
    (contact,) = locator.contacts([weak])
    assert not contact.firm


@pytest.mark.parametrize(("axis", "angle"), [((1.0, 0.0), 0.0), ((0.0, 1.0), np.pi / 2), ((0.0, -1.0), np.pi / 2)])
def test_the_angle_is_that_of_an_undirected_line(locator: Locator, axis: tuple[float, float], angle: float) -> None:
    blob = Blob(u=320, v=240, surface_raw=raw_at(0), seen_raw=raw_at(8), pixels=60, axis=axis, peak=1.0)
    (contact,) = locator.contacts([blob])
    assert abs(contact.angle) == pytest.approx(angle, abs=1e-6)
