"""The third reality: a plant of few masses that air stirs and walls radiate to, a chamber cooled by a valve.

Its plant is not linear and is stepped by Runge and Kutta's rule; its forms are again others, drawn without a
catalogue at hand.
"""
