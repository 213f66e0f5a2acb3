"""Random road profiles with the spectra of ISO 8608."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...errors import ModelError
from ..element import element
from .road import RoadGrid, RoadProfile, RoadSurface

REFERENCE = 0.1  # cycles/m: reference spatial frequency n0
LEAST, MOST = 0.011, 2.83  # cycles/m: range of the standard
SMOOTHEST = 16e-6  # m^3: geometric mean of G_d(n0) of class A; each further class has four times as much
CLASSES = "ABCDEFGH"


@element
class RandomRoad(RoadSurface):
    """A random profile along x with the spectrum of ISO 8608: G_d(n) = G_d(n0) (n / n0)^-w, n0 = 0.1 cycles/m.

    It is a sum of waves of that spectrum with random phases, between 0.011 and 2.83 cycles/m, periodic over its length.
    Two tracks have the coherence of a surface whose statistics are the same in all directions (Kamash and Robson,
    *Journal of Sound and Vibration* 54, 1977).

    Parameters
    ----------
    name : str
        Optional.
    roughness : str or number [m^3]
        Class ``"A"`` (very good) to ``"H"`` (very poor), with the geometric mean of its range; or G_d(n0).
    length : number [m]
        Length of the road, rounded to a multiple of the spacing; 91 m or more, the longest wave.
    spacing : number [m]
        Distance of the heights along x; 0.176 m at most.
    waviness : number
        Exponent w.
    seed : int
        Another seed gives another road.
    start : number [m]
        Place of the first height.
    run_in : number [m]
        Length at the start over which the heights grow from zero.
    track : number [m]
        Distance of two different tracks, at y = track / 2 and -track / 2; one profile for all of the width without it.
    width : number [m]
        Of the road; its middle is y = 0. 100 m if not given, or twice the track.
    """

    roughness: str | float
    length: float
    spacing: float = 0.05
    waviness: float = 2.0
    seed: int = 0
    start: float = 0.0
    run_in: float = 0.0
    track: float | None = None
    width: float | None = None

    def check(self, n: SimpleNamespace) -> None:
        """Refuse numbers that make no road."""
        if isinstance(self.roughness, str) and self.roughness not in tuple(CLASSES):
            raise ModelError(
                f"{self.title}: roughness is {self.roughness!r}; give a class of ISO 8608, 'A' to 'H', or a number"
            )
        if not isinstance(self.roughness, str) and not self.roughness > 0.0:
            raise ModelError(f"{self.title}: roughness is {self.roughness:g} m^3; it must be greater than 0")
        if not 0.0 < self.spacing <= 0.5 / MOST:
            raise ModelError(
                f"{self.title}: spacing is {self.spacing:g} m; it must be greater than 0, and {0.5 / MOST:.3f} m at "
                f"most, so that two heights come on the shortest wave of the standard"
            )
        if not self.length >= 1.0 / LEAST or not 0.0 <= self.run_in <= self.length:
            raise ModelError(
                f"{self.title}: length is {self.length:g} m and run_in {self.run_in:g} m; give a length of "
                f"{1.0 / LEAST:.0f} m or more, the longest wave of the standard, and a run-in within it"
            )
        if not 1.0 < self.waviness < 4.0:
            raise ModelError(f"{self.title}: waviness is {self.waviness:g}; it must be between 1 and 4, usually 2")
        self._profile(np.zeros(2), np.zeros(2)).check(n)

    def density(self, n: np.ndarray) -> np.ndarray:
        """Return the one-sided power spectral density of the heights [m^3] at spatial frequencies [cycles/m]."""
        rough = SMOOTHEST * 4.0 ** CLASSES.index(self.roughness) if isinstance(self.roughness, str) else self.roughness
        return rough * (n / REFERENCE) ** -self.waviness

    def coherence(self, n: np.ndarray) -> np.ndarray:
        """Return the coherence of the two tracks: 2 (pi n b)^v K_v(2 pi n b) / Gamma(v), v = w / 2."""
        from scipy.special import gamma, kv

        v, x = 0.5 * self.waviness, np.pi * n * float(self.track or 0.0)
        return 2.0 * x**v * kv(v, 2.0 * x) / gamma(v)

    def grid(self) -> RoadGrid:
        """Return its heights."""
        count = round(self.length / self.spacing)
        n = np.fft.rfftfreq(count, self.spacing)
        inside = (n >= LEAST) & (n <= MOST) & (n < 0.5 / self.spacing)
        amplitude = np.zeros(len(n))
        amplitude[inside] = np.sqrt(2.0 * self.density(n[inside]) / (count * self.spacing))
        draw = np.random.default_rng(self.seed)
        waves = [amplitude * np.exp(1j * draw.uniform(0.0, 2.0 * np.pi, len(n))) for _ in range(2)]
        if self.track is not None:
            common = np.zeros(len(n))
            common[inside] = self.coherence(n[inside])
            waves[1] = common * waves[0] + np.sqrt(1.0 - common**2) * waves[1]
        z = [np.append(x, x[0]) for x in (np.fft.irfft(0.5 * count * w, count) for w in waves)]
        if self.run_in > 0.0:
            s = np.clip(self.spacing * np.arange(count + 1) / self.run_in, 0.0, 1.0)
            z = [x * s**3 * (10.0 - 15.0 * s + 6.0 * s**2) for x in z]
        return self._profile(*z).grid()

    def _profile(self, left: np.ndarray, right: np.ndarray) -> RoadProfile:
        other: dict[str, Any] = {} if self.track is None else {"right": tuple(right.tolist()), "track": self.track}
        return RoadProfile(
            self.name, heights=tuple(left.tolist()), spacing=self.spacing, start=self.start, width=self.width, **other
        )
