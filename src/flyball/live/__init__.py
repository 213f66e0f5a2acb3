"""A mechanism in the browser while it is computed: sliders for parameters, stepping, and dragging with the mouse.

``session.py`` has the state of one open page and no network code: messages of the page go in, messages to the page come
out. ``server.py`` serves the page and passes messages on this machine; ``widget.py`` does so in a notebook.
"""

from __future__ import annotations

import sys
from typing import Any

from ..errors import ModelError
from ..model.model import Model
from .options import LiveOptions as LiveOptions


def show_live(model: Model, o: LiveOptions) -> Any:
    """Show a model live; see `Mechanism.live`."""
    model = model.snapshot()
    if in_notebook():
        from .widget import live_widget

        if o.port or o.no_open:
            raise ModelError("port and no_open have no effect in a notebook: the page is a widget; leave them out")

        return live_widget(model, o)
    from .server import serve_model

    serve_model(lambda: model, o, lambda address, note: print(f"{address}\n{note}"))
    return None


def in_notebook() -> bool:
    """Return whether this is the kernel of a notebook."""
    ask = getattr(sys.modules.get("IPython"), "get_ipython", None)
    return ask is not None and getattr(ask(), "kernel", None) is not None
