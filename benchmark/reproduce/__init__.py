"""Every number of the documents' findings, made anew and written into them.

`studies.toml` says what is run from sampled starts, and which blocks of the pages are made from it;
`watched` measures ticks, `rows` stores what came of a study, `blocks` makes Markdown, `pages` puts
blocks and outputs of commands in place.
"""
