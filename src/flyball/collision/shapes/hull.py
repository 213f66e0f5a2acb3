"""A convex polyhedron, as `convex_decomposition.Hull` writes it into the tables.

Vertices stand from ``FIRST`` on in `Geometry.vertex`, after them the outward unit normals of its faces, one a
row. Faces stand from ``FACE_FIRST`` on in `Geometry.face`; corners count from the hull's first vertex.
Parameters: rounding radius, and where in `Geometry.face` its edges are, -1 if it is too small to need them: the
numbers of six vertices to begin at (least and largest x, y, z), where the neighbours of each vertex begin,
counted from there, and the neighbours, each list closed by -1.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import absolute
from ...math.vec import dot, load3, store3, sub
from ..narrow_phase.primitives import MAX_CORNERS
from ..shape_kinds import HULL
from ..tables import COUNT, FACE_COUNT, FACE_FIRST, FIRST, PAR

KIND = HULL
EDGE_LISTS = PAR + 1
IN_PLANE = 1e-7  # of the distance, what a vertex may be off the plane of a face that it is a corner of


@formula
def radius(G, i):
    """As given."""
    return G.shape_x[i, PAR]


@formula
def climb_edges(G, first, at, d):
    """Number of the farthest vertex, found along the edges: on a convex body no way up ends lower."""
    x, y, z = absolute(d[0]), absolute(d[1]), absolute(d[2])
    n = 0 if x >= y and x >= z else (1 if y >= z else 2)
    here = G.face[at + 2 * n + (1 if d[n] > 0.0 else 0)]
    best = dot(d, load3(G.vertex, first + here, 0))
    moved = True
    while moved:
        moved = False
        k = at + G.face[at + 6 + here]
        while G.face[k] >= 0:
            value = dot(d, load3(G.vertex, first + G.face[k], 0))
            if value > best:
                best, here, moved = value, G.face[k], True
            k += 1
    return here


@formula
def farthest_vertex(G, i, d):
    """Row of the vertex that is farthest along d."""
    first = G.shape_i[i, FIRST]
    at = int(G.shape_x[i, EDGE_LISTS])
    if at >= 0:
        return first + climb_edges(G, first, at, d)
    here, best = first, dot(d, load3(G.vertex, first, 0))
    for k in range(first + 1, first + G.shape_i[i, COUNT]):
        value = dot(d, load3(G.vertex, k, 0))
        if value > best:
            best, here = value, k
    return here


@formula
def support(G, i, d):
    """A vertex."""
    return load3(G.vertex, farthest_vertex(G, i, d), 0)


@formula
def facing_side(G, i, d, top):
    """Of the faces that hold the vertex ``top``, number and place of the one that looks along d best."""
    first, normals = G.shape_i[i, FIRST], G.shape_i[i, FIRST] + G.shape_i[i, COUNT]
    at = G.shape_i[i, FACE_FIRST]
    number, place, best = 0, at, -2.0
    for f in range(G.shape_i[i, FACE_COUNT]):
        n = load3(G.vertex, normals + f, 0)
        if dot(n, d) > best:
            off = sub(top, load3(G.vertex, first + G.face[at + 1], 0))
            if absolute(dot(n, off)) <= IN_PLANE * (absolute(off[0]) + absolute(off[1]) + absolute(off[2])):
                number, place, best = f, at, dot(n, d)
        at += 1 + G.face[at]
    return number, place


@formula
def face(G, i, d, scratch, at):
    """One of its sides; of one with more corners than there is room for, as many of them, the farthest vertex too."""
    top = farthest_vertex(G, i, d)
    first = G.shape_i[i, FIRST]
    number, place = facing_side(G, i, d, load3(G.vertex, top, 0))
    corners = G.face[place]
    begin = 0
    for k in range(corners if corners > MAX_CORNERS else 0):
        if first + G.face[place + 1 + k] == top:
            begin = k
    count = min(corners, MAX_CORNERS)
    for k in range(count):
        corner = (begin + k * corners // count) % corners
        store3(scratch, at + k, 0, load3(G.vertex, first + G.face[place + 1 + corner], 0))
    return count, number
