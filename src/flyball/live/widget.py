"""The live page as a widget of a notebook: the page in a frame, its messages over the notebook's own connection."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from ..errors import ModelError
from ..model.model import Model
from ..view.page import live_page
from .options import LiveOptions, make_sliders
from .session import ClosedPage, LiveSession, exchange_messages

OPEN, CLOSE = '{"do":"open"}', '{"do":"close"}'
MAX_WAITING = 1000
"""Messages of the page that wait; the oldest are dropped."""
FRAME_SCRIPT = """
function render({ model, el }) {
  const frame = document.createElement("iframe");
  frame.setAttribute("sandbox", "allow-scripts");
  frame.title = model.get("title");
  frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 0`;
  const fromPage = ({ source, data }) => source === frame.contentWindow && typeof data === "string" && model.send(data);
  const fromSession = (_, buffers) => {
    for (const view of buffers) {
      const bytes = view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);
      frame.contentWindow?.postMessage(bytes, "*", [bytes]);
    }
  };
  window.addEventListener("message", fromPage);
  model.on("msg:custom", fromSession);
  frame.srcdoc = model.get("page");
  el.append(frame);
  return () => {
    window.removeEventListener("message", fromPage);
    model.off("msg:custom", fromSession);
    model.send('{"do":"close"}');
  };
}
export default { render };
"""


class WidgetSessions:
    """Sessions in threads of their own, one for each page that the widget has opened; opening one ends the last.

    Parameters
    ----------
    model : Model
    o : LiveOptions
    send : callable
        Sends bytes to the page.
    """

    def __init__(self, model: Model, o: LiveOptions, send: Callable[[bytes], None]) -> None:
        self._model, self._options, self._send = model, o, send
        self._waiting: queue.Queue[str | None] = queue.Queue()

    def receive(self, text: Any) -> None:
        """Receive a message of the page: one begins a session, one ends it, the others are for the session."""
        if text in (OPEN, CLOSE):
            self._waiting.put(None)
            self._waiting = queue.Queue()
            if text == OPEN:
                threading.Thread(target=self._serve, args=(self._waiting,), daemon=True).start()
        elif isinstance(text, str):
            if self._waiting.qsize() >= MAX_WAITING:
                with suppress(queue.Empty):  # the session may have taken them meanwhile
                    self._waiting.get_nowait()
            self._waiting.put(text)

    def _serve(self, waiting: queue.Queue[str | None]) -> None:
        def receive(timeout: float | None) -> str:
            try:
                text = waiting.get(timeout is None or timeout > 0.0, timeout)
            except queue.Empty:
                raise TimeoutError from None
            if text is None:
                raise ClosedPage
            return text

        with suppress(ClosedPage):
            exchange_messages(LiveSession(lambda: self._model, self._options), receive, self._send)


def live_widget(model: Model, o: LiveOptions, height: int = 720) -> Any:
    """Return the widget of a model.

    Raises
    ------
    ModelError
        If the package anywidget is not installed, or a range is invalid.
    """
    try:
        import anywidget
        import traitlets
    except ImportError:
        raise ModelError("a live page in a notebook needs the package anywidget: pip install 'flyball[live]'") from None
    make_sliders(model, o.ranges)  # refuses invalid ranges

    class LiveWidget(anywidget.AnyWidget):
        """A live page."""

        _esm = FRAME_SCRIPT
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)

    widget = LiveWidget(page=live_page(model.name), title=f"{model.name}, live", height=height)
    sessions = WidgetSessions(model, o, lambda message: widget.send({}, [message]))
    widget.on_msg(lambda _, content, buffers: sessions.receive(content))
    return widget
