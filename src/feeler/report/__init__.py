"""Reports: figures, movies, tables, words and numbers as one self-contained page."""

from feeler.report.page import (
    Part,
    Section,
    make_interval,
    make_spread,
    render_page,
    write_page,
)

__all__ = ["Part", "Section", "make_interval", "make_spread", "render_page", "write_page"]

__dir__ = __all__.copy
