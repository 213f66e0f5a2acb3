"""Formulas and kernels: what is compiled, how it becomes object code, and where the object code is stored.

`formulas` has `@formula`, for plain Python that compiled code may inline, and the hashes of sources. `kernels` has
`@kernel`, for entry points with C's calling convention, buffers of their arguments, and code tables of formulas that
are called by address. `struct_layout` reads layouts of arguments from annotations. `numba_target` translates functions
to LLVM text, with the types of `numba_types`; `object_code` links and optimises a kernel as a whole, which takes a
fifth of the time of one function after the other. `object_files` finds and stores the code and says how
long a compilation takes, and `ahead_of_time` compiles every kernel.

Imports NumPy and `errors` only; Numba and llvmlite are imported inside functions, Numba only where something must be
compiled. Nothing inside Numba is replaced. A file with formulas or kernels must be listed in `formulas.COMPILED`. A
kernel should call one formula only: further calls are compiled a second time. Another kind of element whose formulas
are called by address needs a list of `Signature`, a column like `System.force_code`, and a dispatch that ends in
`formula_at`.
"""
