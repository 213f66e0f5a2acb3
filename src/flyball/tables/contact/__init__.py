"""A model's contact in arrays: shapes, surfaces, and what carries them."""

from .touching import Touching as Touching
from .touching import touching as touching
