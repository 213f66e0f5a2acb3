"""What a law of time does, known before it is computed, by interval arithmetic on its program.

Moore, Kearfott and Cloud, *Introduction to Interval Analysis* (2009), chapters 5, 6 and 8.
"""
