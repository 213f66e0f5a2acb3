"""How the scratch of the narrow phase, an array (ROOM, 8), is shared out.

Contacts of the pair come first: point (3), unit normal from 1 to 2 (3), gap, feature (a whole number). The rest is for
whoever is at work: corners of two faces, what is left of one when it is cut by the other, and the simplex and polytope
of the search for the nearest points.
"""

from __future__ import annotations

LIMIT = 128  # contacts of a pair at most
CORNERS = 32  # corners of a face at most
FACE_1 = LIMIT
FACE_2 = FACE_1 + CORNERS
CUT_1 = FACE_2 + CORNERS
CUT_2 = CUT_1 + 3 * CORNERS
NEAREST = CUT_2 + 3 * CORNERS  # simplex and polytope
PIECE = NEAREST + 400  # corners of the part of a height field that is at work
ROOM = NEAREST + 512
