"""Training sets for other people's networks: touches in batches, honest splits, and files that
other tools read.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from feeler.learn.dataset import TouchDataset, split_trials
    from feeler.learn.export import export_parquet, write_crate

# PyTorch and pyarrow are extras and slow to load: each name is fetched when it is used.
_HOMES = {
    "TouchDataset": "dataset",
    "export_parquet": "export",
    "split_trials": "dataset",
    "write_crate": "export",
}

__all__ = ["TouchDataset", "export_parquet", "split_trials", "write_crate"]


def __getattr__(name: str) -> object:
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(
            f"module 'feeler.learn' has no attribute {name!r}; public names: {', '.join(__all__)}"
        )
    return getattr(import_module(f"feeler.learn.{_HOMES[name]}"), name)
