"""Imported first of all, and only, by the process that workers are forked from."""

import gc

# it imports and forks: there is nothing to collect, and looking for it takes a tenth of the time
gc.disable()
