"""Laws: expressions as bytecode, its evaluation, and calls of Python functions from it."""
