"""Description of a mechanism: parts, numbers with units, expressions, checks, files. No numerics.

Elements (`element`) are frozen, validated classes; their fields carry units by type, and the registry finds every
class. `model.Model` holds parts, parameters and settings; `body`, `joint`, `force`, `controller`, `event` and
`contact` have the base classes, `shapes` the geometry, `units` and `expressions` the numbers, `model_files` the
files. `snapshot` returns the same unchangeable copy as long as nothing has changed, and keeps on it
what analyses have derived; parts are compared by identity, values of parameters to the last bit.

What fills tables from here may be run on complex parameters: it decides by real parts and has no ``abs``, ``float()``
or ``norm``. Imports `math`, `constraints` and `rotations` only; pint and SciPy inside functions. Wrong input is
refused where it is added, by a `ModelError` that names element, value, rule and remedy. What an analysis does not
support it refuses through `unsupported_elements`.
"""
