"""Features of a run as text, ``T^1..3, dT, T*dT``: batch, sample by sample, and operators of one's own."""
