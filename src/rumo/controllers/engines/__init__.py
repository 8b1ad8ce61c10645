"""What computes the steps of controllers: the C core, or a method in Python inside the guard."""
