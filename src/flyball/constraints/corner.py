"""A sharp corner M on a face of a box F: how high above it, and how fast it slides over it.

The half edges par[0:3], the radius par[3], the tangent par[4:6] and the height par[6] are those of ``touch``. Which
face it is does not follow from the pose where the corner comes to the end of a face: ``hint`` is its number. It stays
during a step, and where another face is no nearer.
"""

from __future__ import annotations

from ..compiler.jit import formula
from ..math.scalar import absolute
from ..math.vec import cross, dot, mtv, mv, sub
from .along import row as along
from .touch import face, outward, slip

KIND_HEIGHT = 14
KIND_SLIDE = 15
SINGLE = True
ALIKE = 1e-9  # of its distance from the middle: nearer by less is as near


@formula
def above(par, p, n):
    """Height of p above the face with the normal n."""
    return dot(n, p) - (par[0] * n[0] * n[0] + par[1] * n[1] * n[1] + par[2] * n[2] * n[2])


@formula
def foot(par, F, M, hint, data):
    """The face that the corner lies farthest beyond, or nearest below; the one of ``hint`` where that is as near."""
    p = mtv(F[1], sub(M[0], F[0]))
    o = 0.0 * p[0]
    i = face(par, p)
    j = int(hint.real)
    n, m = outward(i, o), outward(j, o)
    more = above(par, p, n) - above(par, p, m)
    size = absolute(p[0]) + absolute(p[1]) + absolute(p[2])
    return o + (i if more.real > ALIKE * size.real else j)


@formula
def progress(par, F, M, s, data):
    """Faces do not change during a step."""
    return 0.0 * s, 0.0 * s


@formula
def height_row(par, F, M, hint, data):
    """Value, force on M at its origin (minus that on F), torques on M and F about their origins, acceleration bias."""
    n = outward(int(hint.real), 0.0 * par[0])
    high = par[6] - above(par, (0.0 * par[0], 0.0 * par[0], 0.0 * par[0]), n)
    return along((n[0], n[1], n[2], par[3], par[4], par[5], high, par[7]), F, M, hint, data)


@formula
def slide_row(par, F, M, hint, data):
    """No value, the wrench of slip, its bias."""
    n = mv(F[1], outward(int(hint.real), 0.0 * par[0]))
    return slip(par, F, M, n, cross(F[2], n))


ROWS = {KIND_HEIGHT: height_row, KIND_SLIDE: slide_row}
