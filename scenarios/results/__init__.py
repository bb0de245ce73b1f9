"""Runs side by side and what came of them: one table of results and one page.

`comparing` runs scenarios under several resolvers, `sampled` from sampled starts or parameters:
`plan` validates a sweep, lists its runs and makes one, `pool` and `cluster` many.
`store` is the table, `columns` its statistics; the other modules are the page.
"""
