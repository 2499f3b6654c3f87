"""The desk: a terminal where a day's design work is done; the only floor that knows Textual."""
