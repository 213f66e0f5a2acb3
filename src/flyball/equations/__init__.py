"""The equations of motion: formulas that loop over the tables, and the compiled entry points made of them."""
