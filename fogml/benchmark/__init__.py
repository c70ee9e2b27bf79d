"""The open benchmark: rounds of cases whose answers are kept apart, methods of anyone, one scorer."""
