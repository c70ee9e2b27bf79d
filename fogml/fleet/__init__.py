"""Many units: manifests, engines that run a job for each, shared priors."""
