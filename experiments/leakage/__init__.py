"""How far a random split flatters a model."""
