"""The first reality: gyro, chamber, table and sensors, written apart from the twin.

Its forms are near those of the catalogue, and its plant is a radial line of shells between case and hub.
"""
