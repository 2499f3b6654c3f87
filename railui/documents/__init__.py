"""What knows every kind of file: check, recognise, compare, save, describe."""
