"""Joints: one file each. A new joint is a new file here and one line below."""

from .cylindrical import Cylindrical as Cylindrical
from .distance import Distance as Distance
from .fixed import Fixed as Fixed
from .prismatic import Prismatic as Prismatic
from .revolute import Revolute as Revolute
from .spherical import Spherical as Spherical
from .translational import Translational as Translational
from .universal import Universal as Universal
