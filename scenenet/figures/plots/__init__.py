"""How each kind of plot is drawn; plain data in, a matplotlib figure out."""
