"""What runs behind the window, as objects of Qt; no rules of its own."""
