"""Other libraries' shapes, so that scripts written for them run here."""
