"""A real cold start, part against part."""
