"""The standard job in what one could pick instead: one file per peer, the same equations, track and answers."""
