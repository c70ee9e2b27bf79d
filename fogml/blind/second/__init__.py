"""The second reality: a winding heated from its flanges too, a thermostat that cycles, memories of any kind.

Its plant is two-dimensional and is solved by its own modes; programmes are those that laboratories run;
each unit's noise has a slope of its own; forms are drawn from wide classes, and whether the catalogue holds
one is never asked.
"""
