"""How results are shown: recordings of motions, animation pages, reports, Matplotlib figures, still pictures.

A recording holds everything that is drawn of a motion, without physics; ``view/animation.py`` makes it from a
result, ``view/page.py`` and ``static/`` (the player, in JavaScript) show it. Modules named ``..._plots`` draw
figures, all in the style of ``view/plotting.py``. Matplotlib is imported inside functions only. It may import
model, results and tables; nothing imports it at top level: results import it when something is shown.
"""
