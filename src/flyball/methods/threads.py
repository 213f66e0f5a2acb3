"""Dense algebra on one thread.

Matrices of mechanisms are small: threads of BLAS wait for one another longer than they work, and on a machine that
others use too a singular value decomposition of 400 x 400 takes sixty times as long on two threads as on one.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import cache, wraps
from typing import Any


def on_one_thread(method: Callable[..., Any], *, by_scipy: bool) -> Callable[..., Any]:
    """The same with BLAS on one thread; ``by_scipy``: SciPy's will be needed, which is loaded first.

    How many threads BLAS has is a setting of the process, so it is changed by Python's main thread only, and set back
    when the method ends.
    """

    @wraps(method)
    def limited(*args: Any, **named: Any) -> Any:
        if threading.current_thread() is not threading.main_thread():
            return method(*args, **named)
        if by_scipy:
            import scipy.linalg  # noqa: F401
        found = _libraries("scipy.linalg" in sys.modules)
        if all(library.num_threads == 1 for library in found.lib_controllers):
            return method(*args, **named)
        with found.limit(limits=1):
            return method(*args, **named)

    return limited


@cache
def _libraries(with_scipy: bool) -> Any:
    """What sets the threads of NumPy's library, and of SciPy's own, if that is loaded."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")
