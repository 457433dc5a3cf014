"""The way of a frame through the core: surface, contacts, tracking. Pure: no clock, thread, socket, file or log.

The same frames, settings and versions give the same touches, to the byte.
"""

from dataclasses import replace

from touchd.contacts.aim import aimed
from touchd.contacts.method import Sighting
from touchd.hands.stage import HandStage, stage_over
from touchd.model import CoarsePicture, Frame, Sensor, State, Surface, TouchFrame
from touchd.ready import PipelineSettings, Ready, prepare
from touchd.surface.calibrate import Calibration
from touchd.surface.living import LivingSurface, Vitals, can_live
from touchd.surface.patient import PatientCalibration, everywhere
from touchd.surface.region import inside_of
from touchd.surface.settings import CalibrationSettings
from touchd.tracking.hovers import HoverTracker
from touchd.tracking.tracker import Tracker

_FRAMES_WHEN_LOST = 60  # to learn a surface from that cannot be found again: people wait for it


class Pipeline:
    """Turns frames into touches: ``step`` one frame, ``stall`` when none came, ``calibrate`` to learn the surface anew.

    It begins without a surface: call ``calibrate``, or ``use`` a stored one.
    """

    def __init__(self, sensor: Sensor, settings: PipelineSettings, made_from: str, first_session_id: int = 1) -> None:
        self._sensor = sensor
        self._settings = settings
        self._made_from = made_from
        self._calibration: Calibration | PatientCalibration | None = None
        self._ready: Ready | None = None
        self._living: LivingSurface | None = None
        self._why: str | None = None
        self._calibrations_ended = 0
        self._tracker = Tracker(settings.tracking, (1.0, 1.0), first_session_id)
        self._hovers = HoverTracker(settings.tracking, (1.0, 1.0))
        self._hands: HandStage | None = None
        self._unsettled: Frame | None = None
        self._last_index = 0

    @property
    def sensor(self) -> Sensor:
        """The camera whose frames it takes."""
        return self._sensor

    @property
    def made_from(self) -> str:
        """What surfaces learned here are said to be made from."""
        return self._made_from

    @property
    def ready(self) -> Ready | None:
        """What frames are looked up in, None while there is no surface yet."""
        return self._ready

    @property
    def calibrations_ended(self) -> int:
        """How many calibrations ended, one way or the other."""
        return self._calibrations_ended

    @property
    def calibration_failure(self) -> str | None:
        """Why the last calibration that ended gave up; None if it did not."""
        return self._why

    @property
    def calibration_is_late(self) -> bool:
        """Whether the calibration under way has waited for longer than it should, and goes on."""
        return self._calibration is not None and self._calibration.gave_up

    @property
    def vitals(self) -> Vitals | None:
        """How the surface has fared since it was learned; None where it is not followed."""
        return None if self._living is None else self._living.vitals()

    @property
    def next_session_id(self) -> int:
        """The id that the next touch would get."""
        return self._tracker.next_session_id

    def step(self, frame: Frame) -> TouchFrame:
        """Return what one frame shows.

        What can wait until that is told is left to :meth:`settle`.
        """
        self.settle()
        self._last_index = frame.index
        if self._calibration is not None:
            return self._calibrate_on(self._calibration, frame)
        self._unsettled = frame
        if self._is_in_a_hurry(frame):
            self.settle()
        ready, hands, living = self._ready, self._hands, self._living
        if ready is None or hands is None:
            return TouchFrame(frame.index, frame.t_ns, State.NO_SURFACE, why="no surface was learned: calibrate")
        if living is not None and living.why is not None:
            self._end_all()
            return TouchFrame(frame.index, frame.t_ns, State.PAUSED, why=living.why)
        raw = hands.cleared(frame.raw, ready.surface.reference if living is None else living.reference)
        seen = self._seen(ready, hands, ready.method.find(raw, self._tracker.expected_mm(frame.t_ns)))
        air = self._hovers.air(seen.hovers)
        touches = self._tracker.step(seen.contacts, frame.t_ns, seen.lifted_mm, air, seen.unseen)
        airborne = self._hovers.step(seen.hovers, frame.t_ns, self._tracker.ground)
        cursors, hovers = hands.owned(touches, airborne, self._tracker.hidden_ids)
        return TouchFrame(
            index=frame.index,
            t_ns=frame.t_ns,
            state=State.TRACKING,
            cursors=cursors,
            why=self._why,
            hovers=hovers,
            hands=hands.hands,
            objects=hands.objects,
            area_mm=ready.area.size_mm,
        )

    def settle(self) -> None:
        """Look at the last frame for hands, things and how the surface fares, if that is still to be done.

        Nothing of it changes what that frame's touches are, unless there is a reason to hurry; then it was done first.
        Call it once they are told; else the next ``step`` begins with it, with the same result.
        """
        frame, self._unsettled = self._unsettled, None
        ready, hands = self._ready, self._hands
        if frame is None or ready is None or hands is None:
            return
        coarse = ready.coarse.over(frame.raw)
        living = self._living
        if living is None:
            hands.see(coarse, frame.t_ns)
            return
        self._live(living, ready, frame, coarse)
        if living.why is None:
            hands.see(coarse, frame.t_ns, living.part_of_surface, living.slides)
            due = hands.due(frame.t_ns)
            if due is not None:
                living.join(due)

    def stall(self, t_ns: int) -> TouchFrame:
        """End every touch because no frame came for a while."""
        self._end_all()
        return TouchFrame(self._last_index, t_ns, State.NO_FRAMES, why="no frame came from the source")

    def calibrate(self) -> None:
        """Learn the surface from exactly the next frames, whatever they show; every touch ends."""
        self._end_all()
        self._calibration = Calibration(self._sensor, self._settings.calibration, self._made_from)

    def calibrate_patiently(self) -> None:
        """Learn the surface from the next frames without motion; every touch ends.

        After ``calibration.give_up_s`` the surface from before is in force again. Without one it goes on trying.
        """
        self._wait_for_surface(self._settings.calibration)

    def use(self, surface: Surface) -> None:
        """Take a surface of this sensor as it is. Live touches go on."""
        self.adopt(self._settings, prepare(surface, self._settings))

    def adopt(self, settings: PipelineSettings, ready: Ready | None) -> None:
        """Go on under other settings, with what :func:`prepare` made of the surface under them. Live touches go on."""
        self._settings, self._unsettled = settings, None
        if ready is not None:
            self._hands = stage_over(ready.lookout, settings.objects, self._hands)
        self._ready = ready
        self._living = self._enlivened(ready)
        area_mm = ready.area.size_mm if ready else (1.0, 1.0)
        self._tracker.adopt(settings.tracking, area_mm)
        self._hovers.adopt(settings.tracking, area_mm)

    def _wait_for_surface(self, settings: CalibrationSettings) -> None:
        self._end_all()
        area = self._settings.area
        shape = (self._sensor.size[1], self._sensor.size[0])
        inside = everywhere(self._sensor) if area is None else inside_of(area, shape)
        self._calibration = PatientCalibration(self._sensor, settings, self._made_from, inside)

    def _end_all(self) -> None:
        self._unsettled = None
        self._tracker.end_all()
        self._hovers.end_all()
        if self._hands is not None:
            self._hands.end_all()

    def _enlivened(self, ready: Ready | None) -> LivingSurface | None:
        """Return the living surface for what frames are looked up in: the one there is, if it is of the same one."""
        if ready is None or not self._settings.living.follow or not can_live(ready.surface):
            return None
        living = self._living
        if living is None or living.surface is not ready.surface:
            living = LivingSurface(ready.surface, ready.surface_map)
        ready.follow(living.whole())
        return living

    def _seen(self, ready: Ready, hands: HandStage, found: Sighting) -> Sighting:
        """Return what was found and is a hand's, where people mean it.

        None of it begins a touch while the surface seems to have been moved.
        """
        doubtful = self._living is not None and self._living.doubtful
        contacts = hands.admitted(found.contacts)
        seen = replace(
            found,
            contacts=[replace(contact, firm=False) for contact in contacts] if doubtful else contacts,
            hovers=hands.admitted(found.hovers),
            unseen=hands.under_others(found.unseen, self._tracker.cursors),
        )
        return seen if self._settings.eye is None else aimed(seen, self._settings.eye, ready.area.size_mm)

    def _is_in_a_hurry(self, frame: Frame) -> bool:
        """Return whether what is known of hands, things and the surface may be wrong for a frame."""
        moved = self._living is not None and self._living.hurries(frame)
        return moved or (self._hands is not None and self._hands.restless)

    def _live(self, living: LivingSurface, ready: Ready, frame: Frame, coarse: CoarsePicture) -> None:
        """Let the surface live by one frame; what has been lost is learned from the beginning."""
        was_learning = living.learning_again
        for rows in living.step(frame, coarse):
            ready.follow(rows)
        if was_learning and not living.learning_again:
            if living.moves:
                self._ready = ready.after_move(living.as_learned_again(ready.area_after_knock(living.turned())))
            else:
                self._ready = replace(ready, surface=living.as_learned_again(None))
        elif living.lost:
            frames = min(_FRAMES_WHEN_LOST, self._settings.calibration.frames)
            self._wait_for_surface(replace(self._settings.calibration, frames=frames))

    def _calibrate_on(self, calibration: Calibration | PatientCalibration, frame: Frame) -> TouchFrame:
        calibration.take(frame)
        surface = calibration.surface
        if surface is not None:
            self._calibration = self._why = None
            self.use(surface)
            self._calibrations_ended += 1
        elif calibration.gave_up and self._ready is not None:
            self._calibration = None
            self._why = f"calibration gave up ({calibration.why}): the surface from before is in force"
            self._calibrations_ended += 1
        elif calibration.gave_up:
            return TouchFrame(frame.index, frame.t_ns, State.NO_SURFACE, why=f"still calibrating: {calibration.why}")
        return TouchFrame(frame.index, frame.t_ns, State.CALIBRATING, why=calibration.why)
