"""What a step by impulses works on, beside shapes, contacts and the cone problem: free bodies, laws, the pace.

Movers (``contact.tables``) are numbered: first the free bodies, each a node of the cone problem with the same number,
then bodies of the mechanism. All vectors are along the world's axes where nothing else is said.
"""

from __future__ import annotations

from typing import NamedTuple

from ..compiler.layout import Float1, Float2, Int1

# columns of Free.body: mass, its inverse, inertia and its inverse about the mass centre in body axes (each xx yy zz xy
# xz yz), 1 if the inertia is the same about every axis
FREE_MASS, FREE_PER_MASS, FREE_INERTIA, FREE_INVERSE, FREE_ROUND = 0, 1, 2, 8, 14
ANGLE = 6  # column of Free.move, behind velocities: angle [rad] about z turned since the start, of what is round
# columns of Tracks.kept: impulse in the world; 1 if it slides, 0 if it sticks, -1 without force; whether it is hit in
# an impact, impulse of that in the world, and its velocities before; of contacts that give way: stiffness (0: hard),
# overlap and its rate at the start of the step, share of its end in the law, overlap of the law and gap at
# the end, overlap that is its spring's; impulse of its torque in the world; relative angular
# velocity before an impact; part of its bias that is no velocity of a surface or gap; relative velocity at the start of
# the step, in the world; whether it goes on: 0, pressed, and at rest along the normal, in the step before (PRESSES), or
# besides with rows wanted in the middle of the step (WANTED), which are found, and make it a mean (MIDDLE)
IMPULSE, SLIDES, HIT, KICK, BEFORE_KICK = 0, 3, 4, 5, 8
STIFF, OVERLAP, RATE, SHARE, TARGET, END_GAP, KEPT = range(11, 18)
TORQUE, TURNED_BEFORE, LEAD, SEEN_FIRST, GOES_ON = 18, 21, 24, 27, 30
TRACKS = 31  # columns
PRESSES, WANTED, MIDDLE = 1.0, 2.0, 3.0  # Tracks.kept[:, GOES_ON]
# entries of Pace.real: time, step; gravity; speed below which nothing bounces; overlap [m] that is
# none; residual [m/s] that is enough for velocities and for positions; residual over the step [m/s^2] above which a
# solve that was cut is told
TIME, STEP, GRAVITY, SLOWEST, FLAT, ENOUGH_V, ENOUGH_X, ROUGH = 0, 1, 2, 5, 6, 7, 8, 9
# ... and sums: work lost in friction, in impacts, given by surfaces that move; worst overlap and residuals seen, time
# of the worst residual, overlap at the start
LOST_FRICTION, LOST_IMPACT, GIVEN, WORST_OVERLAP, WORST_RESIDUAL, WORST_FORCE, WORST_AT, FIRST_OVERLAP = range(10, 18)
STORED, STORED_FIRST = 18, 19  # energy in contacts that give way: now, and at the start
LAST_STEP = 20  # the step before, 0 if there was none
NUMERICAL = 21  # energy that the method took: rows that change within a step, displacements out of overlaps, damping
LONGEST = 22  # the step before it is divided
LEFT_OVER = 23  # residual [m/s] of the last solve for velocities
REALS = 24
# entries of Pace.count: steps still to take, steps taken; most iterations for velocities and positions; law of
# restitution; iterations done, solves cut off, most contacts; how many impacts, in how many of them expansion was cut;
# whether they are one after the other; whether there may be contacts that give way, and whether a step that is too
# long for their impacts is divided; steps whose impacts did not end
LEFT, TAKEN, SWEEPS, LIFTS, LAW, ITERATIONS, CUTS, MOST_CONTACTS, IMPACTS, REDUCED, SEQUENTIAL, YIELDING = range(12)
DIVIDES, ENDLESS = 12, 13
COUNTS = 16
# places in Pace.door: addresses of the search, of the solvers of velocities, positions, impacts, and of the mechanism
# (0: there is none)
SEARCHING, VELOCITIES, POSITIONS, BOUNCE, JOINTS = range(5)
NO_RESTITUTION, POISSON, NEWTON, MOREAU = range(4)  # Pace.count[LAW]


class Free(NamedTuple):
    """Bodies on nothing but gravity and contact."""

    body: Float2  # (n, 16)
    turn: Float2  # (n, 4): unit quaternion, body axes to the world
    before: Float2  # (n, 8): velocities at the start of the step
    move: Float2  # (n, 8): velocities that bodies are displaced with
    start: Float2  # (movers, 18): poses of all movers at the start of the step, and twists


class Tracks(NamedTuple):
    """What is remembered of each contact; one for each of the two tables of contacts."""

    kept: Float2  # (capacity, TRACKS)


class Pace(NamedTuple):
    """Time, choices and sums of a run."""

    real: Float1  # (REALS,)
    count: Int1  # type: ignore[assignment]  # (COUNTS,)
    door: Int1  # (8,)
