"""Training sets for other people's networks: touches in batches, and honest splits."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from feeler.learn.dataset import TouchBatches, TouchDataset, split_trials

# PyTorch is an extra and slow to load: each name is fetched when it is used.
__all__ = ["TouchBatches", "TouchDataset", "split_trials"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(
            f"module 'feeler.learn' has no attribute {name!r}; public names: {', '.join(__all__)}"
        )
    from feeler.learn import dataset

    return getattr(dataset, name)


__dir__ = __all__.copy
