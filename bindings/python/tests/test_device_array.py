# SPDX-License-Identifier: Apache-2.0
"""Images that stay on a GPU: torch and JAX share their memory. Skipped where there is no GPU."""

import gc

import numpy as np
import pytest

import gsnav

pytestmark = pytest.mark.skipif(not any(d.startswith("cuda") for d in gsnav.Device.available()),
                                reason="no GPU, or a package without GSNAV_CUDA=ON")
N = 6


@pytest.fixture
def parts(opened):
    episodes = gsnav.generate_episodes(opened.scene.navmesh, 32, 1)

    def make(device="cuda", source=None, **settings):
        config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(24, 32), task=gsnav.TaskConfig(max_steps=9), **settings)
        return gsnav.BatchSimulator(device, [opened.scene], config, N, lambda e, k: episodes[(e + 5 * k) % 32],
                                    image_source=source)

    return make


def on_backend(make, **settings):
    return make(images=gsnav.ImageMemory.backend, **settings)


def test_torch_shares_the_memory_of_the_images(parts):
    torch = pytest.importorskip("torch")
    sim = on_backend(parts)
    step = sim.reset()
    assert not step.images
    for name, channels in (("rgb", 3), ("depth", 1)):
        image = step.on_backend[name]
        assert image.shape == (N, 24, 32, channels) and image.__dlpack_device__() == (2, 0)
        tensor = torch.from_dlpack(image)
        assert tensor.data_ptr() == image.__cuda_array_interface__["data"][0]
        assert tensor.shape == image.shape and tensor.dtype == torch.float32 and tensor.is_cuda
        assert torch.from_dlpack(image[2]).data_ptr() == tensor[2].data_ptr()
    with pytest.raises(KeyError, match="on_backend"):
        step["rgb"]
    with pytest.raises(IndexError):
        step.on_backend["rgb"][N]
    with pytest.raises(ValueError, match="stream 0"):
        step.on_backend["rgb"].__dlpack__(stream=0)


def test_jax_shares_the_memory_of_the_images(parts):
    jax = pytest.importorskip("jax")
    if jax.default_backend() != "gpu":
        pytest.skip("JAX sees no GPU")
    image = on_backend(parts).reset().on_backend["depth"]
    array = jax.dlpack.from_dlpack(image)
    assert array.unsafe_buffer_pointer() == image.__cuda_array_interface__["data"][0]
    assert array.shape == image.shape


def test_images_and_actions_on_the_device_give_the_bits_of_the_host(parts):
    torch = pytest.importorskip("torch")
    host, device, cpu = parts(), on_backend(parts), parts("cpu")
    steps = [sim.reset() for sim in (host, device, cpu)]
    rng = np.random.default_rng(1)
    for _ in range(25):
        tensors = {k: torch.from_dlpack(v).cpu().numpy() for k, v in steps[1].on_backend.items()}
        for name in ("rgb", "depth"):
            assert np.array_equal(tensors[name], steps[0].images[name])
            assert np.array_equal(tensors[name], steps[2].images[name])
        actions = rng.integers(0, 4, N)
        steps = [host.step(actions), device.step(torch.tensor(actions, device="cuda")),
                 cpu.step(actions.astype(np.int32))]
        assert np.array_equal(steps[0].rewards, steps[1].rewards)


def test_a_step_waits_for_readers_on_the_consumers_stream(parts):
    torch = pytest.importorskip("torch")
    sim, stream = on_backend(parts), torch.cuda.Stream()
    step = sim.reset()
    before = torch.from_dlpack(step.on_backend["rgb"]).clone()
    torch.cuda.synchronize()
    with torch.cuda.stream(stream):
        image = torch.from_dlpack(step.on_backend["rgb"])
        torch.cuda._sleep(int(2e8))  # about 0.1 s
        late = image.clone()
    sim.step([2] * N)  # must not overwrite the images before they are read
    torch.cuda.synchronize()
    assert torch.equal(late, before)


def test_a_batch_draws_into_memory_of_torch(parts):
    torch = pytest.importorskip("torch")
    memory = {0: torch.zeros(4, N, 24, 32, 3, device="cuda"), 1: torch.zeros(4, N, 24, 32, 1, device="cuda")}
    at, expected = 0, []
    given, host = on_backend(parts, source=lambda sensor, floats: memory[sensor][at]), parts()
    given.reset()
    expected.append(host.reset()["rgb"].copy())
    for at in range(1, 4):
        step = given.step([2] * N)
        assert torch.from_dlpack(step.on_backend["depth"]).data_ptr() == memory[1][at].data_ptr()
        expected.append(host.step([2] * N)["rgb"].copy())
    assert np.array_equal(memory[0].cpu().numpy(), np.stack(expected))
    on_host = on_backend(parts, source=lambda sensor, floats: np.zeros(floats, np.float32))
    with pytest.raises(gsnav.InvalidArgument, match="it must be on cuda:0"):
        on_host.reset()


def test_wrong_actions_on_the_device_are_refused(parts):
    torch = pytest.importorskip("torch")
    sim = on_backend(parts)
    sim.reset()
    with pytest.raises(gsnav.InvalidArgument, match="environment 1: action 9"):
        sim.step(torch.tensor([0, 9, 0, 0, 0, 0], device="cuda"))
    with pytest.raises(ValueError, match="shape"):
        sim.step(torch.zeros(N + 1, dtype=torch.int64, device="cuda"))
    with pytest.raises(ValueError, match="contiguous"):
        sim.step(torch.zeros(2 * N, dtype=torch.int64, device="cuda")[::2])
    with pytest.raises(TypeError, match="integers"):
        sim.step(torch.zeros(N, device="cuda"))
    sim.step(torch.ones(N, dtype=torch.uint8, device="cuda"))


def test_arrays_keep_their_simulator_alive(parts):
    torch = pytest.importorskip("torch")
    sim = on_backend(parts)
    step = sim.reset()
    expected = torch.from_dlpack(step.on_backend["depth"]).clone()
    image = step.on_backend["depth"]
    del sim, step
    gc.collect()
    tensor = torch.from_dlpack(image)
    del image
    gc.collect()
    assert torch.equal(tensor, expected)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vector_env_on_the_device(opened, mode):
    torch = pytest.importorskip("torch")
    config = dict(sensors=gsnav.rgbd_sensors(16, 16), task=gsnav.TaskConfig(max_steps=4))
    made = [gsnav.VectorEnv(N, opened, device="cuda", autoreset_mode=mode, config=gsnav.BatchConfig(images=m, **config))
            for m in (gsnav.ImageMemory.host, gsnav.ImageMemory.backend)]
    seen = [envs.reset(seed=3)[0] for envs in made]
    for k in range(10):
        assert np.array_equal(torch.from_dlpack(seen[1]["rgb"]).cpu().numpy(), seen[0]["rgb"])
        results = [envs.step(a) for envs, a in zip(made, (np.full(N, k % 4), torch.full((N,), k % 4, device="cuda")))]
        seen = [r[0] for r in results]
        if "final_obs" in results[0][4]:
            for e in np.flatnonzero(results[0][4]["_final_obs"]):
                final = [r[4]["final_obs"][e]["depth"] for r in results]
                assert np.array_equal(torch.from_dlpack(final[1]).cpu().numpy(), final[0])
