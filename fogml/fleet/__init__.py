"""Many units: manifests, engines that run a job for each, shared priors."""

FORM = "T^1..3, dT, T*dT"
"""The form that units' constants are compared in, unless another is stated."""
