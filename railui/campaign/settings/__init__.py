"""Settings of the loop: the thresholds that steer its verdict."""
