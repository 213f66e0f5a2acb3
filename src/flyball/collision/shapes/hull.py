"""A convex polyhedron, written into the tables by `convex_decomposition.ConvexPolyhedron`.

Vertices are in `Geometry.vertex` from row ``first`` on, followed by the outward unit normals of its faces, one per
row. Faces are in `Geometry.face` from ``face_first`` on; corners are numbered from the hull's first vertex.
Parameters: rounding radius, and the first place of its edges in `Geometry.face`, -1 if it is too small to need them:
the numbers of six start vertices (smallest and largest x, y, z), the place of each vertex's neighbours, counted from
there, and the neighbours, each list closed by -1.
"""

from __future__ import annotations

from ...compiler.formulas import formula
from ...math.scalar import absolute
from ...math.vec import dot, load3, store3, sub
from ..narrow_phase.primitives import MAX_CORNERS
from ..shape_kinds import HULL

KIND = HULL
IN_PLANE = 1e-7  # relative to the distance; largest offset of a vertex from the plane of its face


@formula
def radius(G, i):
    """Return the rounding radius."""
    return G.dimensions.par[i, 0]


@formula
def climb_edges(G, first, at, d):
    """Find the farthest vertex along the edges; on a convex body every ascending path ends at it."""
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
    """Row of the vertex farthest along d."""
    first = G.shape.first[i]
    at = int(G.dimensions.par[i, 1])
    if at >= 0:
        return first + climb_edges(G, first, at, d)
    here, best = first, dot(d, load3(G.vertex, first, 0))
    for k in range(first + 1, first + G.shape.count[i]):
        value = dot(d, load3(G.vertex, k, 0))
        if value > best:
            best, here = value, k
    return here


@formula
def support(G, i, d):
    """Return the farthest vertex."""
    return load3(G.vertex, farthest_vertex(G, i, d), 0)


@formula
def facing_side(G, i, d, top):
    """Return the number and place of the face that faces d best, among those with the vertex ``top``."""
    first, normals = G.shape.first[i], G.shape.first[i] + G.shape.count[i]
    at = G.shape.face_first[i]
    number, place, best = 0, at, -2.0
    for f in range(G.shape.face_count[i]):
        n = load3(G.vertex, normals + f, 0)
        if dot(n, d) > best:
            off = sub(top, load3(G.vertex, first + G.face[at + 1], 0))
            if absolute(dot(n, off)) <= IN_PLANE * (absolute(off[0]) + absolute(off[1]) + absolute(off[2])):
                number, place, best = f, at, dot(n, d)
        at += 1 + G.face[at]
    return number, place


@formula
def face(G, i, d, scratch, at):
    """Write the side that faces d best; of too many corners only `MAX_CORNERS`, including the farthest vertex."""
    top = farthest_vertex(G, i, d)
    first = G.shape.first[i]
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
