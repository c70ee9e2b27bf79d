"""A second reality: gyro, chamber, table and sensors, written apart from the twin.

Nothing here imports the twin; a test holds that. Units are those of the run format: deg/h, degC, deg/s,
s; rates of temperature in degC/min.
"""
