"""What a mechanism can be asked: the signature, defaults and meaning of every analysis, written once, here.

Each is a method of `flyball.Mechanism`. It hands its arguments over as one frozen object, which checks them; the
analysis works with that object, and the subcommand of the same name is made from the signature and its docstring.
"""
