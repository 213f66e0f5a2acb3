"""Laws: expressions as bytecode, one instruction set and its readers, and calls of Python functions from it."""
