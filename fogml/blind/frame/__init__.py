"""What realities have in common: how they are told, the nominal gyro, and by what strength is measured.

A reality is a package of its own that fills a `fogml.blind.frame.unit.Reality`: its plant, programmes,
sensors and noise behind ``draw_unit``, and its forms of effects. It imports this package and nothing else of
fogml; nothing here holds a plant, a programme or a form. Units are those of the run format: deg/h, degC,
deg/s, s; rates of temperature in degC/min.
"""
