"""Two processes of ``torch.distributed`` over one store, as PyTorch's own tutorial has them."""

import numpy as np
import pytest

from feeler import learn
from feeler.errors import InvalidInput

from .conftest import N


def train(rank, store, folder):
    """One epoch of both kinds of dataset in one of two processes; which trials it saw."""
    import torch
    from torch.utils.data import DataLoader, DistributedSampler

    torch.distributed.init_process_group(
        "gloo", init_method=f"file://{folder}/join", rank=rank, world_size=2
    )
    batches = learn.TouchBatches(store, "size", batch_size=44)
    dataset = learn.TouchDataset(store, "size")
    sampler = DistributedSampler(dataset, shuffle=True)
    loaders = {
        "batches": DataLoader(batches, batch_size=None),
        "dataset": DataLoader(dataset, batch_size=44, sampler=sampler),
    }
    torch.manual_seed(rank)
    model = torch.nn.parallel.DistributedDataParallel(torch.nn.Linear(20, 1))
    optimiser = torch.optim.SGD(model.parameters(), 1e-9)
    found = {}
    for name, loader in loaders.items():
        schedule = torch.optim.lr_scheduler.LinearLR(optimiser, total_iters=len(loader))
        trials = []
        for x, y in loader:
            optimiser.zero_grad()
            loss = torch.nn.functional.mse_loss(model(x.flatten(1))[:, 0], y)
            loss.backward()
            optimiser.step()
            schedule.step()
            trials.append(x[:, 0, 0].numpy())
        assert len(trials) == len(loader) == 7
        found[name] = np.concatenate(trials)
    weights = next(model.parameters()).detach().numpy()
    np.savez(f"{folder}/{rank}.npz", weights=weights, **found)
    with pytest.raises(
        InvalidInput, match="600 touches are 1 batches of 600, fewer than the 2"
    ):
        learn.TouchBatches(store, batch_size=600)
    torch.distributed.destroy_process_group()


@pytest.mark.long
def test_two_ranks_share_the_touches_and_end_with_one_model(store, tmp_path):
    torch = pytest.importorskip("torch", reason="needs the extra `torch`")
    torch.multiprocessing.spawn(train, (store, tmp_path), nprocs=2)
    one, two = (np.load(tmp_path / f"{rank}.npz") for rank in range(2))
    np.testing.assert_array_equal(one["weights"], two["weights"])
    for name in ("batches", "dataset"):
        assert not {*one[name]} & {*two[name]}
        assert {*one[name]} | {*two[name]} == {*range(N)}
