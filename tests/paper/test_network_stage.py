"""The network's stage, where PyTorch is installed."""

import threading

import pytest

from paper.figS4 import _one_thread


def test_the_stage_keeps_pytorch_to_one_thread_also_in_threads_that_begin_there():
    torch = pytest.importorskip("torch")
    before, seen = torch.get_num_threads(), []
    torch.set_num_threads(3)
    try:
        with _one_thread(torch):
            worker = threading.Thread(target=lambda: seen.append(torch.get_num_threads()))
            worker.start()
            worker.join()
        assert (seen, torch.get_num_threads()) == ([1], 3)
    finally:
        torch.set_num_threads(before)
