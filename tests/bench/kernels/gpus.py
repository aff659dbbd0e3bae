"""What GPUs offer to work groups. A multiprocessor issues one instruction per clock from each of four schedulers."""
import math

SCHEDULERS = 4
REGISTERS = 65536        # of a multiprocessor
REGISTERS_STEP = 256     # a warp gets a multiple of them
SHARED_RESERVED = 1024   # bytes of every group, for the system

# CUDA C++ programming guide, table of compute capabilities.
ARCHITECTURES = {
    "sm_80": {"shared_bytes": 164 * 1024, "warps": 64, "groups": 32},
    "sm_90": {"shared_bytes": 228 * 1024, "warps": 64, "groups": 32},
    "sm_120": {"shared_bytes": 100 * 1024, "warps": 48, "groups": 24},
}

# Multiprocessors, and a clock under load [GHz]: A100, RTX 5090: the boost clock of the data sheet; Hopper: below it,
# as under a full load.
GPUS = {
    "A100": ("sm_80", 108, 1.41),
    "H100 SXM": ("sm_90", 132, 1.70),
    "H200": ("sm_90", 132, 1.70),
    "RTX 5090": ("sm_120", 170, 2.41),
}


def groups_per_multiprocessor(arch, local_size, registers, shared_bytes):
    """How many work groups run at once, and what limits them."""
    offer = ARCHITECTURES[arch]
    warps = math.ceil(local_size / 32)
    of_warp = math.ceil(registers * 32 / REGISTERS_STEP) * REGISTERS_STEP
    # Each of the four parts of a multiprocessor has a quarter of the registers.
    warps_by_registers = REGISTERS // SCHEDULERS // of_warp * SCHEDULERS
    limits = {"groups": offer["groups"],
              "warps": offer["warps"] // warps,
              "shared memory": offer["shared_bytes"] // (math.ceil(shared_bytes / 128) * 128 + SHARED_RESERVED),
              "registers": warps_by_registers // warps}
    reason = min(limits, key=limits.get)
    return limits[reason], reason


def cloths_at_60_hz(gpu, warp_instructions):
    """If every scheduler issues an instruction in every clock: an upper bound. `warp_instructions` of one step."""
    _, multiprocessors, clock_ghz = GPUS[gpu]
    return multiprocessors * SCHEDULERS * clock_ghz * 1e9 / warp_instructions / 60
