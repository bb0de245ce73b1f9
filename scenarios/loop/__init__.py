"""One tick of control: what is asked, resolved, sent and written down; and what goes wrong."""
