"""One open live page: parameters, the run shown, stepping and dragging. Messages in, messages out; no network.

A message to the page is a JSON object, and with it a packed recording where there is something to show (`encode`). A
message from the page is a JSON object whose ``do`` says what to do:

========================= =============================================================================
``set``                   move the slider ``name`` to ``value``, in its unit
``start``, ``pause``      begin or stop to step continuously
``step``, ``reset``       take one step; return to the initial state of the model
``speed``                 seconds of motion in a second, ``value``
``drag``                  pull the point ``at`` of ``body`` [m, in its frame] to the point ``to`` [m, world], ``by``
                          ``assembly`` (the mechanism follows, closed) or ``force`` (a spring, while stepping); ``t``
                          is the time shown
``release``               release the body
``shown``                 the last picture of stepping is drawn: the next one may come
========================= =============================================================================

Only the newest value of a parameter and the newest point of a body are used: of those that arrive during a run, the
earlier ones are dropped.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FlyballError, ModelError, SimulationError
from ..model.model import Model
from ..model.names import curve_parts
from ..results.result import Result
from ..view.animation import record_motion
from ..view.further_states import record_further_states
from ..view.page import pack_recording
from ..view.recording import Recording
from ..view.reference_picture import reference_svg
from .dragging import AssemblyDrag, DragTarget
from .messages import InvalidMessage, finite_number
from .options import LiveOptions, Slider, make_sliders
from .stepping import PICTURE_INTERVAL, LiveStepping, slow_text

MAX_MESSAGES_AT_ONCE = 1000
"""Messages taken before work goes on: a page that never pauses does not stop it."""
MAX_INVALID_MESSAGES = 50
"""Invalid messages without a valid one between them before a page is closed."""
SLOW_RUN = 1.0
"""Duration of a run [s] from which the page says how slow it is."""
FILE_CHECK_INTERVAL = 0.3
"""Interval between two checks whether the model file has changed [s]."""
MAX_SPEED = 1e9
"""Seconds of motion in a second that can be asked for."""
PROGRESS_AFTER, PROGRESS_INTERVAL = 0.5, 0.25
"""Duration of a run [s] after which the page says how far it is, and the interval between two messages."""
KNOWN_ENERGIES = ("energy.kinetic", "energy.potential", "energy.total")
"""Energies that positions and velocities determine."""


class ClosedPage(Exception):
    """The page has been closed."""


class SupersededRun(Exception):
    """A run is abandoned because a newer value has arrived."""


def encode(kind: str, content: Mapping[str, Any], recording: Recording | None = None) -> bytes:
    """Return a message to the page: length of a JSON object (uint32, little-endian), the object, a packed recording."""
    text = json.dumps({"kind": kind, **content}, allow_nan=False).encode()
    return struct.pack("<I", len(text)) + text + (b"" if recording is None else pack_recording(recording))


class LiveSession:
    """The state behind one page.

    Parameters
    ----------
    load : callable
        Returns the model; called again when its file has changed.
    o : LiveOptions
    file : Path, optional
        The model's file, which is watched.
    wording : callable
        Converts the text of an error to that of the terminal.

    Attributes
    ----------
    sliders : dict of str to Slider
        Parameters that can be moved, with their present values; empty until `work` has loaded the model.
    playback_speed : float
        Seconds of motion in a second of playing that suit the last run.
    """

    def __init__(
        self,
        load: Callable[[], Model],
        o: LiveOptions,
        file: Path | None = None,
        wording: Callable[[str], str] = str,
    ) -> None:
        self._load, self._options, self._file, self._wording = load, o, file, wording
        self._changed, self._checked = _time_of_change(file), time.monotonic()
        self.sliders: dict[str, Slider] = {}
        self._result: Result | None = None
        self._tell: Callable[[bytes], None]
        self._known: Recording
        self._moving: Recording
        self._stepping: LiveStepping | None = None
        self._drag: AssemblyDrag | None = None
        self._target: DragTarget | None = None
        self._pending_tasks: list[str] = ["model", "run"]  # in this order
        self._playing, self._speed, self._steps_requested = False, 1.0, 0
        self.playback_speed = 1.0
        self._model: Model | None = None
        self._drag_began, self._drawing, self._invalid_messages = 0.0, False, 0
        self._commands: dict[str, Callable[[Mapping[str, Any]], None]] = {
            "set": self._set,
            "start": self._start,
            "pause": self._pause,
            "step": self._step,
            "reset": self._reset,
            "speed": self._set_speed,
            "drag": self._drag_to,
            "release": self._release,
            "shown": self._picture_shown,
        }

    # ---- messages from the page

    def receive(self, text: str | bytes) -> None:
        """Take a message of the page; it is worked on by `work`.

        Raises
        ------
        InvalidMessage
            If it is no such message.
        ModelError
            If it asks for what is not possible.
        """
        try:
            message = json.loads(text)
        except (ValueError, RecursionError):
            raise InvalidMessage("a message of the page is not JSON; reload the page") from None
        command = self._commands.get(str(message.get("do"))) if isinstance(message, dict) else None
        if command is None:
            known = ", ".join(self._commands)
            raise InvalidMessage(f"a message of the page asks for none of {known}; reload the page")
        command(message)
        self._invalid_messages = 0

    def _set(self, message: Mapping[str, Any]) -> None:
        name = message.get("name")
        if not isinstance(name, str) or name not in self.sliders:
            raise ModelError(f"there is no parameter {str(name)[:80]!r} to move")
        self.sliders[name] = self.sliders[name].moved(message.get("value"))
        self._drag = self._target = None
        if self._stepping is not None and self._stepping.accepts(name):
            return
        self._request("run")

    def _start(self, message: Mapping[str, Any]) -> None:
        self._playing, self._drag, self._target, self._drawing = True, None, None, False
        self._request("stepper")

    def _pause(self, message: Mapping[str, Any]) -> None:
        self._playing = False

    def _step(self, message: Mapping[str, Any]) -> None:
        self._playing, self._steps_requested, self._drag, self._target = False, 1, None, None
        self._request("stepper")

    def _reset(self, message: Mapping[str, Any]) -> None:
        self._playing, self._steps_requested = False, 0
        self._stepping = self._drag = self._target = None
        self._request("run")

    def _set_speed(self, message: Mapping[str, Any]) -> None:
        self._speed = finite_number(message.get("value"), "speed", 0.0, MAX_SPEED)
        if self._stepping is not None:
            self._stepping.begin_pace()

    def _drag_to(self, message: Mapping[str, Any]) -> None:
        target = DragTarget.from_message(message, self._model)
        if target.by_force != (self._stepping is not None):
            if target.by_force:
                raise ModelError("a body is pulled by a force while the mechanism is stepped: start it first")
            self._playing, self._steps_requested = False, 0
        self._target = target

    def _release(self, message: Mapping[str, Any]) -> None:
        self._target = None

    def _picture_shown(self, message: Mapping[str, Any]) -> None:
        self._drawing = False

    def _request(self, what: str) -> None:
        if what not in self._pending_tasks:
            self._pending_tasks.append(what)

    def refusal(self, error: FlyballError) -> bytes:
        """Return the answer to a message that was refused.

        Raises
        ------
        ClosedPage
            If it was one of too many invalid messages.
        """
        self._invalid_messages += isinstance(error, InvalidMessage)
        if self._invalid_messages > MAX_INVALID_MESSAGES:
            raise ClosedPage("too many invalid messages")
        return encode("error", {"text": self._wording(str(error))})

    # ---- work

    def wait(self) -> float | None:
        """Return how long to wait for a message until there is work [s]; None: until a message arrives."""
        if self._pending_tasks or (self._target is not None and not self._target.by_force):
            return 0.0
        if self._stepping is not None and self._steps_requested:
            return 0.0
        if self._stepping is not None and self._playing and not self._drawing:
            return max(0.0, self._stepping.shown + PICTURE_INTERVAL - time.monotonic())
        return None if self._file is None else FILE_CHECK_INTERVAL

    def work(
        self, poll: Callable[[], None] = lambda: None, tell: Callable[[bytes], None] = lambda message: None
    ) -> Iterator[bytes]:
        """Do the pending tasks, and yield messages to the page.

        Parameters
        ----------
        poll : callable
            Called during a run; it takes waiting messages by `receive`. A run is abandoned when a newer value arrives.
        tell : callable
            Sends a message during a run: how far it is.
        """
        self._tell = tell
        self._check_file()
        while self._pending_tasks:
            task = {"model": self._describe, "run": self._run, "stepper": self._begin}[self._pending_tasks.pop(0)]
            yield from self._report_errors(task, poll)
        if self._target is not None and not self._target.by_force:
            yield from self._report_errors(self._assemble, poll)
        elif self._stepping is not None and (self._steps_requested or (self._playing and not self._drawing)):
            yield from self._report_errors(self._advance, poll)

    def _report_errors(self, work: Callable[..., Iterator[bytes]], poll: Callable[[], None]) -> Iterator[bytes]:
        """Do work; an error goes to the page, in the words of the terminal."""
        try:
            yield from work(poll)
        except SupersededRun:
            pass
        except FlyballError as error:
            self._playing, self._steps_requested, self._target = False, 0, None
            yield encode("error", {"text": self._wording(str(error))})

    def _check_file(self) -> None:
        now = time.monotonic()
        if self._file is None or now - self._checked < FILE_CHECK_INTERVAL:
            return
        self._checked = now
        changed = _time_of_change(self._file)
        if changed is not None and changed != self._changed:
            self._changed = changed
            self._pending_tasks = ["model", "run"]

    def _describe(self, poll: Callable[[], None]) -> Iterator[bytes]:
        """Load the model; sliders whose written value is the same keep their place."""
        self._playing, self._steps_requested = False, 0
        self._stepping = self._drag = self._target = None
        try:
            model = self._load()
            new = make_sliders(model, self._options.ranges)
        except FlyballError:
            self._pending_tasks = []
            raise
        before = self._model.parameters if self._model is not None else {}
        for name, slider in new.items():
            old = self.sliders.get(name)
            if old is not None and before.get(name) == model.parameters[name]:
                new[name] = dataclasses.replace(slider, value=old.value)
        self._model, self.sliders = model, new
        yield encode(
            "model",
            {
                "name": model.name,
                "planar": model.planar,
                "watched": self._file is not None,
                "movable": [b.name for b in model.bodies],
                "sliders": [dataclasses.asdict(x) for x in new.values()],
                "picture": reference_svg(model) if self._result is None else "",  # until the first motion is computed
            },
        )

    def _parameters(self) -> dict[str, float | str]:
        return {name: x.quantity for name, x in self.sliders.items()}

    def _known_model(self) -> Model:
        if self._model is None:
            raise ModelError("the model could not be read; correct it, and reload the page")
        return self._model

    def _run(self, poll: Callable[[], None]) -> Iterator[bytes]:
        """Simulate with the present values of the sliders, and show the motion; stepping begins again."""
        model, o = self._known_model(), self._options
        values = {name: x.value for name, x in self.sliders.items()}
        self._stepping = self._drag = self._target = None
        yield encode("busy", {"text": "computing", "slow": ""})
        began, error = time.perf_counter(), None

        told = PROGRESS_AFTER

        def report(fraction: float) -> None:
            nonlocal told
            poll()
            if "run" in self._pending_tasks:
                raise SupersededRun
            seconds = time.perf_counter() - began
            if fraction > 0.0 and seconds > told:
                told = seconds + PROGRESS_INTERVAL
                self._tell(encode("busy", progress(fraction, seconds, o.t_end)))

        try:
            result = model.simulate(o.t_end, outputs=o.outputs, parameters=self._parameters(), progress=report)  # type: ignore[attr-defined]
        except SimulationError as stopped:
            if not isinstance(stopped.result, Result) or len(stopped.result.t) < 2:
                raise
            result, error = stopped.result, stopped
        seconds = time.perf_counter() - began - result.health.compiling
        self._result = result
        recording = record_motion(result)
        self._known = self._shown_parts(recording)
        self.playback_speed = recording.speed
        span = float(result.t[-1] - result.t[0])
        content = {"values": values, "seconds": seconds, "slow": slow_remark(seconds, span)}
        yield encode("run", content, recording)
        if error is not None:
            yield encode("error", {"text": self._wording(str(error))})
        if self._playing or self._steps_requested:
            self._request("stepper")

    def _begin(self, poll: Callable[[], None]) -> Iterator[bytes]:
        """Make the stepper, unless there is one."""
        if self._stepping is None:
            model = self._known_model()
            if self._result is None:
                raise ModelError(f"{model.name!r} has no motion yet: nothing can be stepped")
            self._stepping = LiveStepping(model, self.sliders, self.playback_speed * PICTURE_INTERVAL / 2.0)
            self._target = None
            yield self._motion([self._stepping.sample()], True)
        self._stepping.begin_pace()
        yield encode("stepping", {"dt": self._stepping.dt, "method": self._stepping.method})

    def _advance(self, poll: Callable[[], None]) -> Iterator[bytes]:
        """Take the steps that are due, and show them."""
        x = self._stepping
        assert x is not None
        try:
            count = None if self._playing else self._steps_requested
            samples = x.advance(self.sliders, self._target, count, self._speed)
        finally:
            self._steps_requested = 0
        if samples:
            self._drawing, began = True, time.monotonic()
            message = self._motion(samples, False, x.slow_remark())
            x.recording = time.monotonic() - began
            yield message

    def _motion(self, samples: list[Any], restart: bool, slow: str = "") -> bytes:
        assert self._stepping is not None
        recording = self._further(self._stepping.motion(samples), restart)
        return encode("motion", {"restart": restart, "slow": slow}, recording)

    def _assemble(self, poll: Callable[[], None]) -> Iterator[bytes]:
        """Move the mechanism so that the dragged point follows, and show it."""
        target = self._target
        assert target is not None
        restart = self._drag is None
        if self._drag is None:
            self._drag = AssemblyDrag(self._known_model(), self._parameters(), *self._shown(target.t))
            self._stepping, self._drag_began = None, time.monotonic()
        recording = self._further(self._drag.move(target), restart)
        self._target = None
        recording = dataclasses.replace(recording, t=np.array([time.monotonic() - self._drag_began]))
        yield encode("motion", {"restart": restart, "slow": "", "closure": self._drag.closure}, recording)

    def _shown(self, t: float) -> tuple[Result, int]:
        """Return the motion on the page, and the number of the output time nearest to t."""
        if self._stepping is not None:
            return self._stepping.motion([self._stepping.sample()]), 0
        if self._result is None:
            raise ModelError("there is no position yet from which a body could be dragged")
        return self._result, int(np.argmin(np.abs(self._result.t - t)))

    def _further(self, states: Result, restart: bool) -> Recording:
        """Record further states; curves that have no value when stepping or dragging begins are left out from then."""
        recording = record_further_states(states, self._known if restart else self._moving)
        self._moving = recording if restart else self._moving
        return recording

    def _shown_parts(self, recording: Recording) -> Recording:
        """Return the parts of the page whose states can be followed: accelerations and reactions are not known."""
        model = self._known_model()

        def known(name: str) -> bool:
            owner, what = curve_parts(name)
            return name in KNOWN_ENERGIES or (owner in model.by_name and not what.startswith("contact_"))

        return dataclasses.replace(recording, channels=tuple(c for c in recording.channels if known(c.name)))


def exchange_messages(
    session: LiveSession, receive: Callable[[float | None], str | bytes], send: Callable[[bytes], None]
) -> None:
    """Pass messages between a page and its session until the page is closed.

    Parameters
    ----------
    session : LiveSession
    receive : callable
        Returns the next message of the page, waiting for this time [s] at most (None: until there is one); it raises
        TimeoutError if there is none, and ClosedPage if the page is closed.
    send : callable
        Sends a message to the page; it raises ClosedPage if the page is closed.

    Raises
    ------
    ClosedPage
        In the end.
    """

    def receive_waiting(timeout: float | None) -> None:
        """Receive all messages that wait, after waiting for the first."""
        with suppress(TimeoutError):
            for _ in range(MAX_MESSAGES_AT_ONCE):
                text = receive(timeout)
                timeout = 0.0
                try:
                    session.receive(text)
                except FlyballError as error:
                    send(session.refusal(error))

    while True:
        receive_waiting(session.wait())
        for message in session.work(lambda: receive_waiting(0.0), send):
            send(message)


def progress(fraction: float, seconds: float, span: float) -> dict[str, str]:
    """Say how far a run over a time span [s] is, how long the rest will need, and how slow it is."""
    left = seconds * (1.0 - fraction) / fraction
    text = f"computing: {100.0 * fraction:.0f} % of {span:g} s, about {left:.0f} s more" if left >= 1.0 else "computing"
    return {"text": text, "slow": slow_remark(seconds / fraction, span)}


def slow_remark(seconds: float, span: float) -> str:
    """Say how slow a computation is; nothing if it is quick."""
    return "" if seconds < SLOW_RUN or span <= 0.0 else slow_text(seconds / span)


def _time_of_change(file: Path | None) -> int | None:
    try:
        return None if file is None else file.stat().st_mtime_ns
    except OSError:  # an editor may replace the file
        return None
