"""Training sets for other people's networks: touches in batches, honest splits, and files that
other tools read.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from feeler.learn.crate import write_crate
    from feeler.learn.dataset import TouchDataset
    from feeler.learn.parquet import export_parquet
    from feeler.learn.split import split_trials

# PyTorch and pyarrow are extras and slow to load: each name is fetched when it is used.
_HOMES = {
    "TouchDataset": "dataset",
    "export_parquet": "parquet",
    "split_trials": "split",
    "write_crate": "crate",
}

__all__ = ["TouchDataset", "export_parquet", "split_trials", "write_crate"]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(
            f"module 'feeler.learn' has no attribute {name!r}; public names: {', '.join(__all__)}"
        )
    return getattr(import_module(f"feeler.learn.{_HOMES[name]}"), name)
