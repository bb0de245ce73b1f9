"""Every number of the documents' findings, made anew and written into them.

`studies` says what is run from sampled starts, `watched` measures ticks, `rows` keeps what came of
it, `claims` judges statements by the rows, `blocks` makes the Markdown of a page from them.
`commands` runs commands and keeps what they print. `pages` puts all of it in place.
"""
