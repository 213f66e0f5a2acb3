"""Printers of expressions, a language a file: what is traced or derived once is written in any of them."""
