"""The patent on scale factor and bias from one temperature run, checked."""
