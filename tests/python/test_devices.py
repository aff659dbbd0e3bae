"""The GPU that a scheduler gave to this process, among those that the server lists. Both lists are imitations."""

import pytest

import drape
from drape import devices

LISTED = """\
0  0000:c1:00.0  GPU-22222222-aaaa-bbbb-cccc-000000000002
1  0000:65:00.0  GPU-11111111-aaaa-bbbb-cccc-000000000001
2  (software)
"""
SMI = """\
0, GPU-11111111-aaaa-bbbb-cccc-000000000001, 00000000:65:00.0
1, GPU-22222222-aaaa-bbbb-cccc-000000000002, 00000000:C1:00.0
"""
FIRST, SECOND = (row.split(", ")[1] for row in SMI.splitlines())


def imitate(path, output):
    path.write_text(f"#!/bin/sh\ncat <<'TEXT'\n{output}TEXT\n")
    path.chmod(0o755)


@pytest.fixture
def assigned(monkeypatch, tmp_path):
    """What `assigned` says with this variable, and these outputs of `draped --list-devices` and of nvidia-smi."""
    def ask(visible, listed=LISTED, smi=SMI):
        imitate(tmp_path / "draped", listed)
        if smi is not None:
            imitate(tmp_path / "nvidia-smi", smi)
        monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin" if smi is not None else "/nowhere")
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", visible)
        return devices.assigned(tmp_path / "draped")

    return ask


@pytest.mark.parametrize("visible, expected", [
    ("0", FIRST), ("1", SECOND), (" 1,0", SECOND), (SECOND, SECOND), ("GPU-1111", FIRST), ("", None), ("-1", None)])
def test_indices_are_those_of_nvidia_smi(assigned, visible, expected):
    assert assigned(visible) == expected


def test_nothing_is_assigned_without_the_variable(monkeypatch):
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert devices.assigned("/nowhere") is None


def test_without_uuids_pci_addresses_are_compared(assigned):
    listed = "".join(line.rpartition("  ")[0] + "\n" for line in LISTED.splitlines())
    assert assigned("1", listed) == "0000:c1:00.0"


def test_without_nvidia_smi_the_order_is_that_of_pci_addresses(assigned, monkeypatch):
    monkeypatch.setattr(devices, "_output", lambda program, *_: None if program == "nvidia-smi" else LISTED)
    assert assigned("0", smi=None) == FIRST and assigned("1", smi=None) == SECOND


def test_a_machine_without_gpus_has_none_to_assign(assigned):
    assert assigned("0", "0  (software)\n") is None


@pytest.mark.parametrize("visible", ["2", "GPU-3333", "MIG-11111111-aaaa-bbbb-cccc-000000000001"])
def test_a_gpu_that_the_server_does_not_see_is_an_error(assigned, visible):
    with pytest.raises(drape.FailedPrecondition, match="0000:65:00.0") as raised:
        assigned(visible)
    assert raised.value.reason == "NO_SUCH_DEVICE"
