"""The net that is trained and the one that robots hear with are the same."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs PyTorch, with which phone nets are trained")

from torch import nn  # noqa: E402

from benchmarks.phones.muon import Muon, orthogonal  # noqa: E402
from benchmarks.phones.score import TEXTS, losses_of, others_of  # noqa: E402
from benchmarks.phones.train import WIDTH, Data, Net, Residual, begun, weights_of  # noqa: E402
from hvcpd.people.bands import N_BANDS  # noqa: E402
from hvcpd.people.phones import PHONES, PhoneNet, near_net  # noqa: E402

RNG = np.random.default_rng(3)


def test_a_residual_layers_gradient_is_that_of_small_differences() -> None:
    torch.manual_seed(1)
    sound, weights, bias = torch.rand(2, 7, 9), torch.randn(9, 9), torch.rand(9)
    given = [each.double().requires_grad_() for each in (sound, weights, bias)]
    assert torch.autograd.gradcheck(Residual.apply, (*given, 2))


def test_what_is_written_is_the_net_that_was_trained(tmp_path: Path) -> None:
    torch.manual_seed(2)
    net = Net([1, 3, 2]).eval()
    np.savez(tmp_path / "net.npz", **weights_of(net))  # type: ignore[arg-type]
    logs = RNG.normal(0, 1, (61, N_BANDS)).astype(np.float32)
    written = PhoneNet.of(np.load(tmp_path / "net.npz"))
    again = begun(tmp_path / "net.npz").eval()
    with torch.no_grad():
        before = net(torch.from_numpy(logs.T[None]))[0].T.numpy()
        after = again(torch.from_numpy(logs.T[None]))[0].T.numpy()
    assert np.allclose(written.layer.logits(written.activations(logs)), after, atol=1e-4)
    assert np.abs(before - after).max() < 0.1 * np.abs(before).max()  # six bits


def test_training_goes_on_from_the_robots_net() -> None:
    net = begun(Path("hvcpd/people/phones_near.npz")).eval()
    logs = RNG.normal(0, 1, (40, N_BANDS)).astype(np.float32)
    with torch.no_grad():
        logits = net(torch.from_numpy(logs.T[None]))[0].numpy()
    assert np.allclose(logits.T, near_net().layer.logits(near_net().activations(logs)), atol=1e-3)


def test_each_take_is_in_one_batch(tmp_path: Path) -> None:
    n_frames = RNG.integers(40, 900, 60)
    n_phones = RNG.integers(1, 9, 60)
    np.savez(
        tmp_path / "data.npz",
        logs=RNG.normal(0, 1, (n_frames.sum(), N_BANDS)).astype(np.float16),
        n_frames=n_frames,
        phones=RNG.integers(0, len(PHONES), n_phones.sum()).astype(np.int8),
        n_phones=n_phones,
    )
    data = Data([tmp_path / "data.npz"])
    batches = list(data.batches(RNG))
    assert sorted(number for batch in batches for number in batch) == list(range(60))
    for batch in batches:
        sound, frames, phones, length = data.batch(batch, None)
        assert sound.shape[2] >= n_frames[batch].max()
        assert frames.tolist() == ((n_frames[batch] + 1) // 2).tolist()
        assert int(length.sum()) == len(phones)
    assert near_net().layer.weights.shape[0] == WIDTH


def test_the_texts_beside_what_was_said_are_others_of_about_its_length() -> None:
    said = [RNG.integers(0, 9, n).astype(np.int64) for n in (*(7,) * 30, *(9,) * 80, *(40,) * 50, 0)]
    said.append(said[3])
    texts = others_of(said, 3)
    assert len(texts) == TEXTS
    assert np.array_equal(texts[0], said[3])
    assert len({text.tobytes() for text in texts}) == TEXTS
    assert max(map(len, texts)) == 9


def test_what_a_net_heard_is_likelier_than_another_text() -> None:
    heard = np.full((12, len(PHONES) + 1), -9.0, np.float32)
    heard[:, -1] = -0.1
    for frame, phone in ((2, 4), (6, 7)):
        heard[frame] = -9.0
        heard[frame, phone] = -0.01
    net = SimpleNamespace(log_posteriors=lambda _logs: heard)
    losses = losses_of(net, np.zeros((24, N_BANDS), np.float32), [np.array([4, 7]), np.array([7, 4]), np.array([4])])  # type: ignore[arg-type]
    assert losses.argmin() == 0


def test_muons_steps_are_those_of_pytorchs() -> None:
    torch.manual_seed(4)
    begin = torch.randn(24, 9)
    ours, theirs = nn.Parameter(begin.clone()), nn.Parameter(begin.clone())
    optimizers = (
        Muon([ours], 0.02, 0.1),
        torch.optim.Muon([theirs], 0.02, weight_decay=0.1, adjust_lr_fn="match_rms_adamw"),
    )
    for _ in range(4):
        gradient = torch.randn(24, 9)
        ours.grad, theirs.grad = gradient.clone(), gradient.clone()
        for optimizer in optimizers:
            optimizer.step()
    assert torch.allclose(ours, theirs, atol=2e-3)  # theirs have two bytes
    assert (ours - begin).abs().max() > 0.02


@pytest.mark.parametrize("shape", [(5, 12), (12, 5)])
def test_an_orthogonal_steps_singular_values_are_about_1(shape: tuple[int, int]) -> None:
    torch.manual_seed(5)
    values = torch.linalg.svdvals(orthogonal(torch.randn(*shape), torch.float32))
    assert 0.6 < float(values.min()) <= float(values.max()) < 1.3
