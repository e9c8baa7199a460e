"""Readers that crash or hang, in a file of their own: the guard's process loads nothing else for
them.
"""

import os


def crash(path):
    os.kill(os.getpid(), 11)


def spin(path):
    while True:
        pass
