"""What motions without events cost beside another checkout of flyball: two processes, asked by turns.

    python benchmarks/against.py ../flyball-before [--rounds 20] [--json FILE]

``loop`` is the compiled loop alone, over a motion; ``call`` a whole `simulate` of the same motion; ``short`` one that
ends after a thousandth of it, so that what every call costs is seen; ``import`` a process that imports it, ``load``
besides reads a model file. CPU times, the least of all rounds; ratios are this checkout over the other.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import timing  # before numpy: it fixes the thread counts

HERE = Path(__file__).resolve().parents[1]
MOTIONS: dict[str, tuple[str, dict[str, Any], float]] = {  # example, its options, seconds
    "andrews": ("andrews.toml", {}, 0.03),
    "chain of 6": ("pendulum_chain.py", {"links": 6}, 5.0),
    "four-bars, 10": ("n_four_bar.py", {"windows": 10}, 5.0),
    "governor": ("governor.toml", {}, 5.0),
    "slider-crank": ("slider_crank.toml", {}, 5.0),
}
LAYERS = ("absolute", "joint")
WHAT = ("loop", "call", "short")
COLUMNS = {"what": "what", "other": "other [ms]", "here": "here [ms]", "ratio": "ratio"}
OUTPUTS = 201


def works() -> dict[str, Callable[[], float]]:
    """What is timed in this process: name -> CPU seconds of one go."""
    import mechanisms

    out = {}
    for name, (file, options, seconds) in MOTIONS.items():
        model = mechanisms.example(file, **options)
        for layer in LAYERS:
            o: dict[str, Any] = {"coordinates": layer, "specialize": False, "outputs": OUTPUTS}
            out[f"{name}, {layer}: loop"] = mechanisms.Kernel(model, seconds, OUTPUTS, coordinates=layer).seconds
            out[f"{name}, {layer}: call"] = lambda m=model, t=seconds, o=o: timing.cpu(lambda: m.simulate(t, **o))
            out[f"{name}, {layer}: short"] = lambda m=model, t=1e-3 * seconds, o=o: timing.cpu(
                lambda: m.simulate(t, **(o | {"outputs": 2}))
            )
    return out


def serve() -> None:
    """Time what is asked for, one name a line, and answer with CPU seconds."""
    known = works()
    for work in known.values():
        work()  # compiled, or read from the cache
    print(json.dumps(list(known)), flush=True)
    for line in sys.stdin:
        print(known[line.strip()](), flush=True)


class Other:
    """A process that times what it is asked for with the flyball of a checkout."""

    def __init__(self, checkout: Path) -> None:
        self.env = os.environ | {"PYTHONPATH": f"{checkout / 'src'}"}
        command = [sys.executable, __file__, "--serve"]
        self.process = subprocess.Popen(
            command, env=self.env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=checkout
        )
        self.names: list[str] = json.loads(self._line())

    def _line(self) -> str:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit("the process of a checkout ended")
        return line

    def ask(self, name: str) -> float:
        """CPU seconds."""
        assert self.process.stdin is not None
        print(name, file=self.process.stdin, flush=True)
        return float(self._line())

    def fresh(self, code: str) -> float:
        """CPU seconds of a process of its own that runs some code."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", code], env=self.env, check=True, cwd=HERE, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def compared(first: Other, second: Other, ask: Callable[[Other], float], rounds: int) -> tuple[float, float]:
    """The least seconds of both, by turns."""
    a, b = [], []
    for k in range(rounds):
        for one, times in ((first, a), (second, b))[:: 1 if k % 2 else -1]:
            times.append(ask(one))
    return min(a), min(b)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", nargs="?", help="another checkout of flyball")
    parser.add_argument("--rounds", type=int, default=20, help="readings of each (20)")
    parser.add_argument("--only", default="", help="what has this in its name")
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.serve:
        return serve()
    if not arguments.checkout:
        parser.error("which other checkout?")
    other, here = Other(Path(arguments.checkout).resolve()), Other(HERE)
    rows = []
    file = HERE / "examples" / "slider_crank.toml"
    asks: dict[str, Callable[[Other], float]] = {n: lambda o, n=n: o.ask(n) for n in here.names}  # type: ignore[misc]
    asks["import flyball"] = lambda o: o.fresh("import flyball")
    asks["load a model file"] = lambda o: o.fresh(f"import flyball; flyball.load({str(file)!r})")
    for name, ask in ((n, a) for n, a in asks.items() if arguments.only in n):
        was, now = compared(other, here, ask, arguments.rounds)
        rows.append({"what": name, "other": 1e3 * was, "here": 1e3 * now, "ratio": now / was})
    print(timing.table(rows, COLUMNS))
    timing.write_json(arguments.json, rows)


if __name__ == "__main__":
    main()
