"""The live page in a notebook: a widget whose frame speaks with a session in the kernel, without any address."""

from __future__ import annotations

import base64
import queue
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import flyball as fb
from flyball import live
from flyball.live.widget import FRAME_SCRIPT, MAX_WAITING, WidgetSessions, live_widget
from flyball.view.page import live_page
from tests.live.pages import FOUR_BAR, options, read

NOTEBOOK = """
<!doctype html><body><div id="cell"></div><script type="module">
const listeners = new Set();
const state = { page: %s, title: "four-bar, live", height: 700 };
const model = {
  get: (name) => state[name],
  on: (_, listener) => listeners.add(listener),
  off: (_, listener) => listeners.delete(listener),
  send: (text) => window.toKernel(text),
};
window.fromKernel = (text) => {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  for (const listener of listeners) listener({}, [new DataView(bytes.buffer)]);
};
%s
window.end = render({ model, el: document.getElementById("cell") });
</script></body>
"""


def test_the_frame_shows_what_the_kernel_computes(browser: Any, tmp_path: Any) -> None:
    import json

    sent: queue.Queue[bytes] = queue.Queue()
    sessions = WidgetSessions(fb.load(FOUR_BAR), options(), sent.put)
    page = json.dumps(live_page("four-bar")).replace("</", "<\\/")
    path = tmp_path / "notebook.html"
    path.write_text(NOTEBOOK % (page, FRAME_SCRIPT.replace("export default { render };", "")), encoding="utf-8")
    tab = browser.new_page(offline=True)
    errors: list[str] = []
    tab.on("pageerror", lambda error: errors.append(error.message))
    tab.expose_function("toKernel", sessions.receive)
    tab.goto(path.as_uri())

    def pass_on(until: str) -> dict[str, Any]:
        for _ in range(600):
            try:
                message = sent.get_nowait()
            except queue.Empty:
                tab.wait_for_timeout(50)
                continue
            tab.evaluate("(text) => window.fromKernel(text)", base64.b64encode(message).decode())
            if (content := read(message))["kind"] == until:
                return content
        raise AssertionError(f"no {until} within 30 s")

    pass_on("run")
    frame = tab.frame_locator("iframe")
    frame.locator("body[data-ready]").wait_for(timeout=60_000)
    field = frame.get_by_label("Value of speed", exact=True)
    field.fill("80")
    field.press("Enter")
    values = pass_on("run")["values"]
    assert values["speed"] == 80.0
    own = tab.frames[1]
    shown = own.evaluate("(flyball.seek(0.5), flyball.pose())")
    r = fb.load(FOUR_BAR).simulate(1.0, outputs=101, parameters={"speed": 80 * 2 * np.pi / 60})
    assert shown[0][:2] == pytest.approx(r["crank"].position[50].tolist(), abs=1e-6)
    tab.evaluate("window.end()")
    assert errors == []
    tab.close()


def test_a_notebook_gets_a_widget_and_refuses_what_has_no_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("anywidget", reason="anywidget is not installed: there is no widget")
    kernel = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=object()))
    assert not live.in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    assert live.in_notebook()
    m = fb.load(FOUR_BAR)
    with pytest.raises(fb.ModelError, match="port and no_open have no effect in a notebook"):
        m.live(port=5000)
    with pytest.raises(fb.ModelError, match="no parameter 'sped'"):
        m.live(ranges={"sped": (1, 2)})
    monkeypatch.undo()
    widget = live_widget(m, options())
    assert "connect-src" not in widget.page
    assert widget.title == "four-bar, live"


def test_the_oldest_of_too_many_waiting_messages_are_dropped() -> None:
    sessions = WidgetSessions(fb.load(FOUR_BAR), options(), lambda _: None)
    for k in range(MAX_WAITING + 5):
        sessions.receive(str(k))
    waiting = list(sessions._waiting.queue)
    assert (len(waiting), waiting[0], waiting[-1]) == (MAX_WAITING, "5", str(MAX_WAITING + 4))


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(fb.ModelError, match=r"pip install 'flyball\[live\]'"):
        live_widget(fb.load(FOUR_BAR), options())
