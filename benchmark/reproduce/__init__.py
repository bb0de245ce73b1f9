"""Every number of the documents' findings, made anew and written into them.

`studies.toml` says what is run from sampled starts, and which blocks of the pages are made from it;
`studies` runs and keeps them, `ticks` measures single ticks, `blocks` makes Markdown, `pages` puts
blocks and outputs of commands in place.
"""
