"""The programmed path: lines, arcs and helices, and the joints between them."""
