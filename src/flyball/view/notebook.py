"""How a document is shown inside a notebook."""

from __future__ import annotations

import html


def iframe(document: str, height: int = 660) -> str:
    """Wrap an HTML document for ``_repr_html_``.

    Parameters
    ----------
    document : str
        A self-contained HTML document.
    height : int
        Height of the frame [px].

    Returns
    -------
    str
        An ``iframe`` that carries the document in itself, so that it survives saving and exporting the notebook; the
        document runs its scripts but reaches nothing outside the frame.
    """
    style = f"width:100%;height:{int(height)}px;border:0"
    return (
        f'<iframe srcdoc="{html.escape(document)}" sandbox="allow-scripts" title="Animation" style="{style}"></iframe>'
    )
