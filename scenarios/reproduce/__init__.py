"""Every number of the documents' findings, made anew over sampled starts and written into them.

`studies` says what is run, `rows` keeps what came of it, `claims` judges statements by the rows,
`blocks` makes the Markdown of a page from them, `pages` puts it in place.
"""
