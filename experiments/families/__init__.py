"""The diagnosis on families beside the present one, on the same blind cases."""
