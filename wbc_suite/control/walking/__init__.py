"""The controller WHOLE_BODY_ID: robots that walk, and use their hands."""
