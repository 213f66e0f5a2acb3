"""The compiled mechanism: tables, the loops over them, and the only list of kinds."""
