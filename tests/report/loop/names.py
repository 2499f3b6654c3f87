"""Names of the campaign in these tests."""

CAMPAIGN_NAME = """worn <b>"axle" & box</b>"""
CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")
