"""Where many cases run: threads of this machine or a cluster, a store that forgets nothing."""
