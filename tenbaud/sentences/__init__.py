"""Sentences for people, made from the fields of events, endings and guard reasons.

Only what shows something to a person calls these functions, and no program reads what they return.
Call them through their module (`events.event_text`), so that a test can replace all of them.
"""
