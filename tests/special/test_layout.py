"""Made code finds arrays where the tables have them: as many dimensions, in their order."""

from __future__ import annotations

from flyball.analysis.motion.start import begin
from flyball.special.layout import DIMENSIONS
from tests.mechanisms import four_bar


def test_arrays_have_the_dimensions_that_code_reckons_with():
    c = begin(four_bar().snapshot(), 0.0, None, None, "auto").assembly.compiled
    for name, of in (("System", c.system), ("Work", c.work)):
        found = []
        for field, x in of._asdict().items():
            found += [(f"ldl_{k}", a.ndim) for k, a in x._asdict().items()] if field == "ldl" else [(field, x.ndim)]
        assert DIMENSIONS[name] == found
