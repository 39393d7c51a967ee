"""Works in chunks: a process that dies costs its chunk, a work that kills is named, a cluster does the same."""

import importlib.util
import json
import os
import time
from itertools import repeat
from pathlib import Path

import pytest

from sensorgen.core import cache, parallel
from sensorgen.core.errors import BadInput, SensorgenError
from sensorgen.core.parallel import in_parallel, open_lanes, remembered


def fatal(number, folder, deaths):
    """The square; number 3 first ends its process so many times."""
    dead = len(list(Path(folder).iterdir()))
    if number == 3 and dead < deaths:
        (Path(folder) / str(dead)).touch()
        os._exit(1)
    return number**2


def asked(number):
    return cache.answer({"what": "square", "number": number}, lambda: number**2)


def test_a_death_costs_one_chunk(tmp_path):
    """One death: the chunk is sent again. Every death: it is divided, and its work alone is lost."""
    works = [(k, str(tmp_path), 1) for k in range(6)]
    assert dict(in_parallel(fatal, works, 2)) == {k: k**2 for k in range(6)}
    works = [(k, str(tmp_path), 99) for k in range(6)]
    found = dict(in_parallel(fatal, works, 2, lost=lambda k, reason: f"{k}: {reason:.15}"))
    assert found == {k: k**2 for k in range(6) if k != 3} | {3: "3: a process ended"}
    with pytest.raises(SensorgenError, match="a process ended before its answer"):
        dict(in_parallel(fatal, works, 2))


def endless(number):
    """The square; number 3 goes round in compiled code, which looks at no signal."""
    return max(repeat(0)) if number == 3 else number**2


@pytest.mark.skipif(os.name == "nt", reason="no limits of processor time on Windows")
def test_a_work_that_does_not_end_is_lost_as_one_that_kills(monkeypatch):
    monkeypatch.setattr(parallel, "_LIMIT_S", 0.2)
    found = dict(in_parallel(endless, [(k,) for k in range(6)], 2, lost=lambda k, reason: f"{k}: {reason:.15}"))
    assert found == {k: k**2 for k in range(6) if k != 3} | {3: "3: a process ended"}


def patient(number):
    time.sleep(0.3)
    return number**2


def test_waiting_takes_nothing_of_the_limit(monkeypatch):
    monkeypatch.setattr(parallel, "_LIMIT_S", 0.1)
    assert dict(in_parallel(patient, [(k,) for k in range(4)], 2)) == {k: k**2 for k in range(4)}


def late(path):
    if path:
        time.sleep(3)
        Path(path).touch()
    return path


def test_who_stops_asking_does_not_wait_for_what_is_under_way(tmp_path):
    """As Ctrl-C does: processes end at once, and nobody works on."""
    found = in_parallel(late, [("",), (str(tmp_path / "late"),)], 2)
    assert next(found) == (0, "")
    found.close()
    assert list(tmp_path.iterdir()) == []


def where(number):
    return os.getpid(), os.environ["OPENBLAS_NUM_THREADS"]


def test_lanes_stay_for_several_rounds(tmp_path, monkeypatch):
    """Two rounds, a death between them; each process has one thread for linear algebra, and this one its own."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "7")
    with open_lanes(2) as lanes:
        first = dict(in_parallel(where, [(k,) for k in range(8)], 2, lanes=lanes))
        again = dict(in_parallel(where, [(k,) for k in range(8)], 2, lanes=lanes))
        assert {pid for pid, _ in again.values()} <= {pid for pid, _ in first.values()}
        assert {threads for _, threads in first.values()} == {"1"}
        assert os.getpid() not in {pid for pid, _ in first.values()}
        works = [(k, str(tmp_path), 1) for k in range(6)]
        assert dict(in_parallel(fatal, works, 2, lanes=lanes)) == {k: k**2 for k in range(6)}
        assert len(dict(in_parallel(where, [(k,) for k in range(8)], 2, lanes=lanes))) == 8
    assert os.environ["OPENBLAS_NUM_THREADS"] == "7"


def test_works_that_are_stopped_go_on_where_they_were(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.PLACE, str(tmp_path))
    works = [(k,) for k in range(6)]
    first = remembered(asked, works, 1)
    assert [next(first) for _ in range(4)] == [(k, k**2) for k in range(4)]
    first.close()
    with cache.only_known():
        assert [asked(k) for k in range(3)] == [0, 1, 4]
    handed = []

    def counted(work, some, *_, **__):
        handed.append(len(some))
        return ((k, work(*s)) for k, s in enumerate(some))

    monkeypatch.setattr(parallel, "in_parallel", counted)
    assert dict(remembered(asked, works, 1)) == {k: k**2 for k in range(6)}
    assert handed == [2]


def test_a_cluster_that_does_not_answer_is_one_line(monkeypatch):
    monkeypatch.setattr(parallel, "_CONNECT_S", 0.2)
    with pytest.raises(SensorgenError, match=r"no Dask scheduler at 'tcp://127.0.0.1:9'") as error:
        list(in_parallel(divmod, [(7, 2)], 1, cluster="tcp://127.0.0.1:9"))
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_gives_the_same(tmp_path):
    """Workers of Dask are threads of this process; the scheduler file names it. When it goes away, one line says so."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="inproc"
    ) as cluster:
        works = [(k, 3) for k in range(40)]
        assert dict(in_parallel(divmod, works, 1, cluster=cluster.scheduler_address)) == {
            k: divmod(k, 3) for k in range(40)
        }
        with pytest.raises(ZeroDivisionError):
            dict(in_parallel(divmod, [(1, 0)], 1, cluster=cluster.scheduler_address))


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_goes_away_is_one_line(monkeypatch, capfd):
    """Works that are not sent yet can have no result; those that have come are kept. Dask itself prints nothing."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(parallel, "_CONNECT_S", 1.0)
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None)
    results = in_parallel(divmod, [(k, 3) for k in range(400)], 1, cluster=cluster.scheduler_address)
    number, found = next(results)
    assert found == divmod(number, 3)
    cluster.close()
    with pytest.raises(SensorgenError, match="no longer answers; results so far are kept"):
        list(results)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("leaves", [True, False])
def test_what_dask_makes_of_cancelled_futures_is_one_line(monkeypatch, leaves):
    """Dask may unpack the state of a future that it has cancelled wrongly: a ValueError, if the cluster went away."""
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(parallel, "_CONNECT_S", 1.0)
    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None)

    def work():
        with open_lanes(1, cluster.scheduler_address) as lanes:
            if leaves:
                cluster.close()
                until = time.monotonic() + 20
                while lanes[0].client.status == "running" and time.monotonic() < until:
                    time.sleep(0.01)
            raise ValueError("not enough values to unpack")

    expected, words = (SensorgenError, "no longer answers") if leaves else (ValueError, "unpack")
    with pytest.raises(expected, match=words):
        work()
    cluster.close()


@pytest.mark.parametrize(
    ("address", "refused"),
    [
        ("10.0.0.5:8786", True), ("ws://cluster.example:80", True), ("tcp://[2001:db8::1]:8786", True),
        ("tls://10.0.0.5:8786", False), ("localhost:9", False), ("tcp://[::1]:9", False),
    ],
)  # fmt: skip
def test_a_cluster_on_a_network_needs_tls(address, refused, monkeypatch, tmp_path):
    file = tmp_path / "scheduler.json"
    file.write_text(json.dumps({"address": address}))
    for trusted in (False, True):
        monkeypatch.setenv(parallel.TRUST_CLUSTER, "1" if trusted else "")
        if refused and not trusted:
            with pytest.raises(BadInput, match=r"expected tls:// or this computer, or sensorgen --trust-cluster"):
                parallel._check_private(address)
        else:
            parallel._check_private(address)
    if refused and importlib.util.find_spec("distributed"):
        monkeypatch.delenv(parallel.TRUST_CLUSTER)
        with pytest.raises(BadInput, match="without TLS"):
            list(in_parallel(divmod, [(7, 2)], 1, cluster=str(file)))


@pytest.mark.parametrize("content", ["tcp://[localhost", '{"id": 1}', "no JSON", "[]"])
def test_what_is_no_address_of_a_cluster_is_one_line(content, tmp_path):
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    file.write_text(content)
    with pytest.raises(BadInput, match="expected a scheduler's address, as tls://"):
        list(in_parallel(divmod, [(7, 2)], 1, cluster=content if "://" in content else str(file)))
