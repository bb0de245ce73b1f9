"""Every number of the documents' findings, made anew and written into them.

`protocol` makes the runs that `protocol.toml` asks for, `verdicts` judges its claims, `fronts`
tunes and tests methods, `blocks` makes Markdown, `pages` puts blocks and outputs of
commands in place.
"""
