"""What the diagnoses of two hundred units of one line tell together, against what acts in them."""
