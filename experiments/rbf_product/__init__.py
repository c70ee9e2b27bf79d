"""The patent on the product of temperature and its change as an input of an RBF network, checked."""
