"""Alarms of units in service: how often they are false, and how late they come."""
