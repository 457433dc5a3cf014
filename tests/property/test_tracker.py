from dataclasses import dataclass
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.model import Contact, Cursor, Unseen
from touchd.tracking.settings import TrackingSettings
from touchd.tracking.tracker import Tracker

AREA_MM = (600.0, 400.0)
FRAME_NS = 33_333_333


def contact(x_mm: float, y_mm: float, firm: bool = True) -> Contact:
    return Contact(
        x=x_mm / AREA_MM[0],
        y=y_mm / AREA_MM[1],
        x_mm=x_mm,
        y_mm=y_mm,
        height_mm=9.0,
        area_mm2=150.0,
        angle=0.0,
        firm=firm,
    )


contacts = st.lists(st.builds(contact, st.floats(-40, 640), st.floats(-40, 440), st.booleans()), max_size=6)
rows = st.frozensets(st.integers(0, 5))
sessions = st.lists(
    st.tuples(contacts, st.integers(1, 6), st.builds(Unseen, hidden=rows, standing=rows)), min_size=1, max_size=12
)
Session = list[tuple[list[Contact], int, Unseen]]
ALL_HIDDEN = Unseen(hidden=frozenset(range(72)))


@dataclass(frozen=True)
class Life:
    begun: list[int]
    ended: list[int]


def lives(frames: list[tuple[Cursor, ...]]) -> Life:
    begun: list[int] = []
    ended: list[int] = []
    alive: set[int] = set()
    for cursors in frames:
        now = {c.session_id for c in cursors}
        begun += sorted(now - alive)
        ended += sorted(alive - now)
        alive = now
    return Life(begun, ended)


def play(session: Session) -> list[tuple[Cursor, ...]]:
    tracker = Tracker(TrackingSettings(), AREA_MM)
    frames, t_ns = [], 0
    for seen, steps, unseen in session:
        t_ns += steps * FRAME_NS
        frames.append(tracker.step(seen, t_ns, unseen=unseen))
    tracker.end_all()
    return [*frames, tracker.step([], t_ns + FRAME_NS)]


@settings(deadline=None)
@given(sessions)
def test_ids_count_up_from_one_and_every_begin_has_one_end(session: Session) -> None:
    life = lives(play(session))
    assert life.begun == list(range(1, len(life.begun) + 1))
    assert sorted(life.ended) == life.begun


@settings(deadline=None)
@given(sessions, st.randoms(use_true_random=False))
def test_the_order_in_which_contacts_come_does_not_matter(session: Session, random: Random) -> None:
    shuffled = [(random.sample(seen, len(seen)), steps, unseen) for seen, steps, unseen in session]
    assert play(session) == play(shuffled)


@settings(deadline=None)
@given(sessions)
def test_cursors_stay_in_the_area_and_are_listed_by_id(session: Session) -> None:
    for cursors in play(session):
        assert [c.session_id for c in cursors] == sorted(c.session_id for c in cursors)
        assert all(0.0 <= c.x <= 1.0 and 0.0 <= c.y <= 1.0 for c in cursors)


@settings(deadline=None)
@given(sessions)
def test_no_touch_outlives_its_contact_by_more_than_the_coasting_time(session: Session) -> None:
    coast_frames = int(TrackingSettings().coast_ms * 1e6 // FRAME_NS)
    silent: Session = [([], 1, Unseen())] * (coast_frames + 1)
    assert play([*session, *silent])[-2] == ()


@settings(deadline=None)
@given(sessions)
def test_no_touch_is_waited_for_longer_than_half_a_second_whatever_hides_it(session: Session) -> None:
    silent: Session = [([], 1, ALL_HIDDEN)] * 17
    assert play([*session, *silent])[-2] == ()
