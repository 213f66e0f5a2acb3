"""Results of one mechanism end to end as one: a motion that was computed in parts, each from where the last ended."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..tables.values import Values, values
from .booked import booked
from .bulk import ARRAYS, Bulk
from .contact_health import ContactHealth
from .contacts import end_to_end
from .energy import STORED
from .events import Happening
from .health import Health
from .moment import Moment
from .result import Result
from .stretches import Stretch, Stretches, stretched
from .struck import Struck


def joined(parts: Sequence[Result], times: np.ndarray) -> Result:
    """The parts as one result at the output times that were asked for; the last row of the last part stays, too.

    Energies that each counts since its own start are added up. What its health tells late is for the caller to say.
    """
    if len(parts) == 1:
        return parts[0]
    last = parts[-1]
    keep = [np.isin(p.t, times) for p in parts]
    if len(keep[-1]):
        keep[-1][-1] = True
    for p, mine, after in zip(parts, keep, parts[1:], strict=False):
        if len(p.t) and len(after.t) and p.t[-1] == after.t[0]:  # what happened at that time is in the later one
            mine[-1] = False
    t, *rows = (
        np.concatenate([getattr(p, name)[k] for p, k in zip(parts, keep, strict=True)])
        for name in ("t", "q", "v", "states", "vdot", "multipliers")
    )
    q, v, states, vdot, multipliers = rows
    out = Result(last.model, last.values, t, q, v, states, vdot, multipliers, _health([p.health for p in parts]))
    out.final, out.carried, out.wound = last.final, dict(last.carried), parts[0].wound
    out.begun = parts[0].begun
    known = Known(last.values)
    out.stretches = _stretches(parts, keep, known)
    out.exchanged = _exchanged(parts, keep)
    if out.stretches is not None:
        out.exchanged |= booked(out)
    if last.contacts is not None:
        taken = [
            p.contacts.taken(np.flatnonzero(k)) for p, k in zip(parts, keep, strict=True) if p.contacts is not None
        ]
        out.contacts = end_to_end(taken, out.t)
    out.bulk = {name: _bulk([p.bulk[name] for p in parts], keep) for name in last.bulk}
    out.events = [_loose(h, known) for p in parts for h in p.events]  # type: ignore[assignment]
    return out


class Known:
    """Tables of one structure by the parameters that they are made with: parts from files bring others of their own."""

    def __init__(self, x: Values) -> None:
        self._structure, self._all = x.structure, {self._key(x): x}

    @staticmethod
    def _key(x: Values) -> bytes:
        return x.system.const[: len(x.structure.model.parameters)].tobytes()

    def __call__(self, x: Values) -> Values:
        """The same numbers in the one structure, always the same object."""
        key = self._key(x)
        if key not in self._all:
            self._all[key] = x if x.structure is self._structure else values(self._structure, x.told)
        return self._all[key]


def _stretches(parts: Sequence[Result], keep: Sequence[np.ndarray], known: Known) -> Stretches | None:
    out: list[Stretch] = []
    lost = given = 0.0
    for p, k in zip(parts, keep, strict=True):
        if p.stretches is None:
            return None
        first = 0
        for x in p.stretches.all:
            mine = k[first : first + x.rows]
            first += x.rows
            out.append(
                dataclasses.replace(
                    x,
                    rows=int(mine.sum()),
                    sigma=x.sigma[:, mine] if x.sigma.ndim == 2 else x.sigma,
                    values=known(x.values),
                    lost=x.lost + lost,
                    given=x.given + given,
                )
            )
        lost, given = out[-1].lost, out[-1].given
    return stretched(out)


def _exchanged(parts: Sequence[Result], keep: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """What contacts exchanged since the start of all; the last row of a part is its end."""
    out = {}
    for name in parts[-1].exchanged:
        rows, before = [], 0.0
        for p, k in zip(parts, keep, strict=True):
            x = p.exchanged[name] + (0.0 if name == STORED else before)
            rows.append(x[k])
            before = float(x[-1]) if len(x) else before
        out[name] = np.concatenate(rows)
    return out


def _bulk(every: Sequence[Bulk], keep: Sequence[np.ndarray]) -> Bulk:
    """Quaternions go on with the sign that they had."""
    turns = [every[0].quaternion]
    for b in every[1:]:
        q = b.quaternion
        if len(q) and len(turns[-1]):
            q = q * np.where((q[:1] * turns[-1][-1:]).sum(axis=2, keepdims=True) < 0.0, -1.0, 1.0)
        turns.append(q)
    told = {name: [getattr(b, name) for b in every] for name in ARRAYS} | {"quaternion": turns}
    rows: dict[str, Any] = {
        name: np.concatenate([x[k] for x, k in zip(all_of, keep, strict=True)]) for name, all_of in told.items()
    }
    return dataclasses.replace(every[0], **rows)


def _loose(h: Happening, known: Known) -> Happening:
    """What happened, as the motion knew it: its states are read in the whole."""
    sides = [x.y if isinstance(x, Moment) else x for x in (h.before, h.after)]
    both = [known(x.values) for x in (h.before, h.after) if isinstance(x, Moment)]
    impulses = h.impulses.loose() if isinstance(h.impulses, Struck) else h.impulses
    tables = tuple(both) if len(both) == 2 else None
    return dataclasses.replace(h, before=sides[0], after=sides[1], tables=tables, impulses=impulses)


def _health(every: Sequence[Health]) -> Health:
    first, last = every[0], every[-1]
    return dataclasses.replace(
        last,
        **{name: max(getattr(h, name) for h in every) for name in ("violation", "velocity_violation")},
        **{name: sum(getattr(h, name) for h in every) for name in COUNTED},
        **{name: getattr(first, name) for name in ("coordinates", "engine", "departures", "options")},
        method=_method([h.method for h in every]),
        remarks=tuple(dict.fromkeys(r for h in every for r in h.remarks)),
        watched=next((h.watched for h in reversed(every) if h.watched), ""),
        contact=_contact([h.contact for h in every if h.contact]),
        late={},
    )


def _method(every: Sequence[str]) -> str:
    """By what each part went from when on; why it was not by another method is told once."""
    told = every[0].split("; ")
    for words in (x for part in every[1:] for x in part.split("; ") if SINCE in x):
        if words not in told and not (THOUGH in words and any(THOUGH in x for x in told)):
            told.append(words)
    return "; ".join(told)


SINCE, THOUGH = " from t = ", ", though "  # how `Pace` tells a change of the method, and that there is none
COUNTED = ("steps", "rejected", "evaluations", "factorisations", "seconds", "compiling")
LARGEST = ("most", "worst_overlap", "residual", "force_residual")
ADDED = ("solves", "iterations", "unconverged", "halved", "reduced", "impacted")


def _contact(every: Sequence[ContactHealth]) -> ContactHealth | None:
    if not every:
        return None
    worst = max(every, key=lambda h: h.residual)
    return dataclasses.replace(
        every[0],
        **{name: max(getattr(h, name) for h in every) for name in LARGEST},
        **{name: sum(getattr(h, name) for h in every) for name in ADDED},
        impacts=next((h.impacts for h in every if h.impacts), ""),
        worst_at=worst.worst_at,
        notes=tuple(dict.fromkeys(n for h in every for n in h.notes)),
    )
