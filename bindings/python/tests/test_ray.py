# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import stat
import time
import zlib

import numpy as np
import pytest

import gsnav
import gsnav.ray

CONFIG = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(16, 24), task=gsnav.TaskConfig(max_steps=15))


def policy_maker(slow=1000):
    """Maker of a policy whose actions depend on images and on random numbers of the episode.

    It is slow in episodes from the index `slow` on.
    It is a local function, so that Ray sends it by value: actors cannot import the tests.
    """

    def make_policy(envs):
        steps = [0] * envs.num_envs
        before = [-1] * envs.num_envs

        def policy(observations, playing):
            assert observations["rgb"].shape == (envs.num_envs, 16, 24, 3) and playing.shape == (envs.num_envs,)
            time.sleep(0.05 * (max(playing) >= slow))
            actions = []
            for e, index in enumerate(playing):
                steps[e] = steps[e] + 1 if index == before[e] else 0
                before[e] = index
                rng = np.random.default_rng([int(index) + 1, steps[e]])
                bright = int(observations["rgb"][e].sum() * 1000)
                actions.append(0 if rng.uniform() < 0.05 else 1 + (bright + int(rng.integers(3))) % 3)
            return actions

        return policy

    return make_policy


@pytest.fixture(scope="module")
def episodes():
    scene = gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto"))
    return gsnav.generate_episodes(scene.scene.navmesh, 26, 3)


@pytest.fixture(scope="module")
def alone(episodes, tmp_path_factory):
    """Journal and observed depths of a single process."""
    workers = gsnav.ray.Workers(actors=0, environments=3, config=CONFIG)
    journal = tmp_path_factory.mktemp("alone") / "journal.jsonl"
    workers.evaluate(episodes, policy_maker(), journal, piece=4)
    rollouts = list(workers.rollouts(episodes, policy_maker(), piece=4, keep=["depth"]))
    return journal.read_bytes(), rollouts


def test_a_single_process_plays_every_episode(episodes, alone):
    header, *lines = map(json.loads, alone[0].splitlines())
    assert header["journal"] == "gsnav.ray" and [line["episode"] for line in lines] == list(range(26))
    world = gsnav.Simulator("cpu", gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto")), CONFIG)
    assert {line["metrics"]["stop_called"] for line in lines} == {True, False}
    for line, rollout, episode in zip(lines[:5], alone[1], episodes):  # the same as without a vector environment
        seen, rewards = world.reset(episode), []
        for i, action in enumerate(line["actions"]):
            assert np.array_equal(seen["depth"], rollout.observations["depth"][i])
            seen = world.step(int(action))
            rewards.append(seen.reward)
        assert world.done and sum(rewards) == line["reward"] and rewards == rollout.rewards.tolist()
        for name, value in line["metrics"].items():
            assert getattr(world.metrics(), name) == (np.inf if value is None else value), name


EDITED = r"notes\.txt: line 3 is not that of episode 1: its crc32 is .*, but its other fields give"
TURNED = str.maketrans("23", "32")


def test_a_line_has_the_checksum_of_its_text(alone):
    for line in alone[0].splitlines()[1:]:
        text, _, last = line.rpartition(b", ")
        assert last == b'"crc32": "%08x"}' % zlib.crc32(text)


def wrong_numbers(whole):
    """Journals whose line 3 is wrong, and words of the error."""
    row = json.loads(whole[2])
    metrics = row["metrics"]
    for change, words in [({"id": "other"}, "line 3 .* its id is 'other', not '1'"),
                          ({"reward": float("nan")}, "line 3 .* not finite"),
                          ({"metrics": {**metrics, "spl": float("nan")}}, "line 3 .* not finite"),
                          ({"metrics": {**metrics, "spl": float("inf")}}, "line 3 .* not finite"),
                          ({"metrics": {**metrics, "spl": "high"}}, "line 3"), ({"reward": 10**400}, "line 3"),
                          ({"metrics": {**metrics, "success": None}}, "line 3 .* EpisodeMetrics.success"),
                          ({"metrics": []}, "line 3"), ({"episode": None}, "line 3"),
                          ({"episode": 1.0}, "line 3"),
                          ({"more": 1}, "line 3 .* its fields are not actions, crc32, episode"),
                          ({"actions": row["actions"][1:]}, "line 3 .* its actions are not those of"),
                          ({"actions": "z" * len(row["actions"])}, "line 3 .* actions"), ({"actions": 5}, "line 3"),
                          ({"metrics": {**metrics, "stop_called": not metrics["stop_called"]}}, "line 3 .* actions"),
                          ({"reward": row["reward"] + 1e-9}, EDITED), ({"reward": None}, EDITED),
                          ({"metrics": {**metrics, "spl": 0.5}}, EDITED), ({"crc32": "00000000"}, EDITED),
                          ({"metrics": {**metrics, "success": not metrics["success"]}}, EDITED),
                          ({"actions": row["actions"].translate(TURNED)}, EDITED), ({"crc32": None}, EDITED)]:
        yield "".join([*whole[:2], json.dumps({**row, **change}) + "\n", *whole[3:]]), words
    yield "".join([*whole[:2], whole[2].replace('"reward": ', '"reward": 9, "reward": '), *whole[3:]]), EDITED
    bare = re.sub(', "crc32": "[^"]*"', "", whole[2])
    yield "".join([*whole[:2], bare, *whole[3:]]), "line 3 .* its fields are not"
    yield whole[0].replace('"format": 2', '"format": 1') + whole[1], "line 1: format = 1: this gsnav reads 2"
    for line in ("[1]", "[" * 100000):
        yield "".join([*whole[:2], line + "\n", *whole[3:]]), "line 3"
    yield "".join([*whole, whole[-1]]), "line 28: there are only 26 episodes"


def test_a_journal_behind_a_link_and_a_file_that_was_left(episodes, alone, tmp_path):
    workers = gsnav.ray.Workers(actors=0, environments=3, config=CONFIG)
    (tmp_path / "disk").mkdir()
    journal, link, other = tmp_path / "disk" / "journal.jsonl", tmp_path / "link.jsonl", tmp_path / "mine"
    link.symlink_to(journal)
    journal.with_name("journal.jsonl.part").write_bytes(alone[0][:2000])  # of a process that was killed
    for _ in range(2):
        workers.evaluate(episodes, policy_maker(), link, piece=4)
        assert link.is_symlink() and journal.read_bytes() == alone[0]
        assert sorted(p.name for p in journal.parent.iterdir()) == ["journal.jsonl"]
    part = journal.with_name("journal.jsonl.part")
    for block in (lambda: part.write_text("my notes"), lambda: part.symlink_to(other), part.mkdir):
        block()
        other.write_text("mine")
        with pytest.raises(gsnav.InvalidArgument, match="journal.jsonl.part is in the way"):
            workers.evaluate(episodes, policy_maker(), journal, piece=4)
        assert journal.read_bytes() == alone[0] and other.read_text() == "mine"
        part.rmdir() if part.is_dir() else part.unlink()


def test_a_journal_is_a_file_in_a_folder(episodes, tmp_path):
    workers = gsnav.ray.Workers(actors=0, environments=3, config=CONFIG)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path, error, words in [(pipe, gsnav.InvalidArgument, "pipe: it is a folder or a device"),
                               (tmp_path, gsnav.InvalidArgument, "it is a folder or a device"),
                               (tmp_path / "no" / "file", gsnav.FileNotFound, "there is no folder")]:
        with pytest.raises(error, match=words):
            workers.evaluate(episodes, policy_maker(), path, piece=4)
    assert stat.S_ISFIFO(pipe.stat().st_mode) and [p.name for p in tmp_path.iterdir()] == ["pipe"]
    workers.close()
    with pytest.raises(gsnav.ClosedEnvironment):
        workers.evaluate(episodes, policy_maker(), tmp_path / "journal", piece=4)
    assert [p.name for p in tmp_path.iterdir()] == ["pipe"]


def test_kept_observations_are_those_before_the_actions(episodes, alone):
    workers = gsnav.ray.Workers(actors=0, environments=3, config=CONFIG, copy=False)
    rollouts = list(workers.rollouts(episodes[:8], policy_maker(), piece=4, keep=["depth"]))
    for rollout, expected in zip(rollouts, alone[1]):
        assert np.array_equal(rollout.observations["depth"], expected.observations["depth"])


def test_wrong_arguments_are_named(episodes):
    config = {"config": CONFIG, "environments": 2}
    for more, error, words in [({"actors": -1}, gsnav.InvalidArgument, "actors = -1"),
                               ({"actors": None}, TypeError, "actors: expected an integer, got None"),
                               ({"actors": True}, TypeError, "actors"),
                               ({"actors": 0, "options": 5}, TypeError, "options"),
                               ({"actors": 0, "environments": "x"}, TypeError, "environments"),
                               ({"actors": 0, "environments": 0}, gsnav.InvalidArgument, "environments = 0")]:
        with pytest.raises(error, match=words):
            gsnav.ray.Workers(**{**config, **more})
    workers = gsnav.ray.Workers(actors=0, **config)
    for more, error, words in [({"first": -1}, gsnav.InvalidArgument, "first = -1"),
                               ({"first": 1.5}, TypeError, "first"), ({"piece": True}, TypeError, "piece"),
                               ({"keep": "depth"}, TypeError, "keep: .* 'depth'"), ({"keep": 5}, TypeError, "keep"),
                               ({"keep": ["x"]}, gsnav.InvalidArgument, "no 'x'; there are rgb, depth")]:
        with pytest.raises(error, match=words):
            list(workers.rollouts(episodes, policy_maker(), **more))
    for make_policy in (None, lambda envs: None):
        with pytest.raises(TypeError, match="make_policy.*: expected a function, got None"):
            list(workers.rollouts(episodes, make_policy))
    assert len(list(workers.rollouts(episodes[:2], policy_maker()))) == 2


def test_a_journal_is_continued(episodes, alone, tmp_path):
    workers = gsnav.ray.Workers(actors=0, environments=3, config=CONFIG)
    journal = tmp_path / "journal.jsonl"
    for size in (0, 10, 2000, len(alone[0]) - 3, len(alone[0])):
        journal.write_bytes(alone[0][:size])
        metrics = workers.evaluate(episodes, policy_maker(), journal, piece=4)
        assert journal.read_bytes() == alone[0], size
        assert [repr(m) for m in metrics] == [repr(r.metrics) for r in alone[1]]
    for wrong in (episodes[:25], [*episodes[:25], episodes[0]]):
        with pytest.raises(gsnav.InvalidArgument, match="other episodes"):
            workers.evaluate(wrong, policy_maker(), journal, piece=4)
    whole = alone[0].decode().splitlines(keepends=True)
    foreign = tmp_path / "notes.txt"
    for text, words in [("my notes", "other episodes"), (whole[0] + "x\n" + "".join(whole[2:]), "line 2"),
                        ("".join([whole[0], whole[2], whole[1], *whole[3:]]), "line 2 .* of episode 1"),
                        ("".join([*whole[:3], *whole[4:]]), "line 4"),
                        ("".join([*whole[:2], whole[2].replace('"spl"', '"lps"'), *whole[3:]]), "line 3 .* metrics"),
                        *wrong_numbers(whole)]:
        foreign.write_text(text)
        with pytest.raises(gsnav.InvalidArgument, match=words):
            workers.evaluate(episodes, policy_maker(), foreign, piece=4)
        assert foreign.read_text() == text
    with pytest.raises(gsnav.InvalidArgument, match="piece"):
        list(workers.rollouts(episodes, policy_maker(), piece=0))
    workers.close()
    with pytest.raises(gsnav.ClosedEnvironment):
        list(workers.rollouts(episodes, policy_maker()))


def test_a_journal_is_of_its_scenes(episodes, tmp_path):
    scene = gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto"))
    objects = gsnav.ray.Workers(scene, actors=0, environments=3, config=CONFIG)
    with pytest.raises(gsnav.InvalidArgument, match="by name"):
        objects.evaluate(episodes, policy_maker(), tmp_path / "objects.jsonl")
    assert not (tmp_path / "objects.jsonl").exists() and len(list(objects.rollouts(episodes[:2], policy_maker()))) == 2
    identities = [gsnav.ray.Workers(one, actors=0, environments=3, config=CONFIG)._identity
                  for one in (tmp_path / "a.ply", str(tmp_path / "a.ply"), tmp_path / "b.ply")]
    a, same, b = (gsnav._journal.header(one, episodes, 4) for one in identities)
    assert a == same != b


def test_a_relative_name_is_of_its_folder(episodes, tmp_path, monkeypatch):
    headers = []
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        monkeypatch.chdir(tmp_path / folder)
        workers = gsnav.ray.Workers("a.ply", actors=0, environments=3, config=CONFIG)
        monkeypatch.chdir(tmp_path)
        headers.append(gsnav._journal.header(workers._identity, episodes, 4))
    (tmp_path / "link").symlink_to("two")
    for name in (tmp_path / "two" / "a.ply", "two/a.ply", "two/../one/../two/a.ply", "link/a.ply"):
        workers = gsnav.ray.Workers(name, actors=0, environments=3, config=CONFIG)
        headers.append(gsnav._journal.header(workers._identity, episodes, 4))
    assert len(set(headers)) == 2 and len(set(headers[1:])) == 1
    resolved = gsnav._journal.resolved
    assert resolved("default") == "default" and resolved(workers) is workers
    assert resolved("link/b.scene_dataset_config.json#c/d") == f"{tmp_path}/two/b.scene_dataset_config.json#c/d"


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_of_two_nodes_one_killed(episodes, alone, tmp_path):
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    try:
        node = cluster.add_node(num_cpus=2)
        ray.init(address=cluster.address, log_to_driver=False, logging_level="ERROR")
        workers = gsnav.ray.Workers(actors=3, environments=3, config=CONFIG)
        ray.get([actor.ready.remote() for actor in workers._actors])
        played = []
        for rollout in workers.rollouts(episodes, policy_maker(slow=8), piece=8, keep=["rgb", "depth"]):
            if not played:
                # The other two actors end their pieces. One of them is on the node, and its result is lost.
                where = [a.__ray_call__.remote(lambda _: ray.get_runtime_context().get_node_id())
                         for a in workers._actors]
                assert sorted(ray.get(where)).count(node.node_id) == 2
                cluster.remove_node(node, allow_graceful=False)
            if len(played) == 13:
                ray.kill(workers._actors[0])
            played.append(rollout)
        assert workers.deaths >= 1
        assert "".join(gsnav._journal.line(r) + "\n" for r in played).encode() == alone[0].split(b"\n", 1)[1]
        assert all(np.array_equal(a.observations["depth"], b.observations["depth"]) for a, b in zip(played, alone[1]))
        workers.close()
        cluster.add_node(num_cpus=2)
        for actors in (1, 3):
            workers = gsnav.ray.Workers(actors=actors, environments=3, config=CONFIG)
            workers.evaluate(episodes, policy_maker(), tmp_path / f"{actors}.jsonl", piece=4)
            assert (tmp_path / f"{actors}.jsonl").read_bytes() == alone[0]
            workers.close()

        def wrong(envs):
            raise KeyError("mine")

        workers = gsnav.ray.Workers(actors=1, environments=3, config=CONFIG)
        with pytest.raises(KeyError, match="mine"):
            list(workers.rollouts(episodes, wrong))

        def deadly(envs):
            os._exit(1)

        with pytest.raises(gsnav.BackendFailure, match="again and again"):
            list(workers.rollouts(episodes, deadly))
        with pytest.raises(FileNotFoundError, match="nowhere"):
            list(gsnav.ray.Workers("nowhere.ply", actors=1).rollouts(episodes, policy_maker()))
    finally:
        ray.shutdown()
        cluster.shutdown()
