"""The tables of `drape_bench speed` in words, in the order of the subcommand."""

import peers
import speed_cost
import speed_curve
import speed_fabrics
import speed_kernels
import speed_local_sizes
import speed_nvcloth
import speed_service
import speed_skips
import speed_solves
import speed_unlike

COLUMNS = {"speed_limits": speed_solves.COLUMNS, "speed_cost": speed_cost.COLUMNS, "speed_flatness": speed_cost.FLATNESS_COLUMNS,
           "speed_curve": speed_curve.COLUMNS, "speed_service": speed_service.COLUMNS, "speed_skips": speed_skips.COLUMNS,
           "speed_unlike": speed_unlike.COLUMNS, "speed_fabrics": speed_fabrics.COLUMNS,
           "speed_nvcloth": speed_nvcloth.COLUMNS, "speed_peers": peers.COLUMNS,
           "speed_kernels": speed_kernels.COLUMNS, "speed_local_sizes": speed_local_sizes.COLUMNS, "speed_packing": speed_local_sizes.PACKING_COLUMNS}
TEXT_COLUMNS = {"along", "program", "family", "method", "settings", "status", "preset", "backend", "path", "device", "limit", "unit", "view", "call", "skip", "build", "difference", "cloth"} | speed_local_sizes.TEXT_COLUMNS | speed_kernels.TEXT_COLUMNS


def speed_text(tables, cpu_backend, gl_device):
    """Parts that were not measured are left out."""
    text = []
    if tables["speed_limits"]:
        text += speed_solves.limits_text(tables["speed_limits"])
    if tables["speed_limits"] and tables["speed_cost"]:
        text += speed_solves.solves_text(tables["speed_limits"], tables["speed_cost"])
    if tables["speed_cost"]:
        text += speed_cost.cost_text(tables["speed_cost"], tables["speed_flatness"] or [], cpu_backend)
    if tables["speed_unlike"]:
        text += speed_unlike.unlike_text(tables["speed_unlike"])
    if tables["speed_fabrics"]:
        text += speed_fabrics.fabrics_text(tables["speed_fabrics"])
    if tables["speed_skips"]:
        text += speed_skips.skips_text(tables["speed_skips"])
    if tables["speed_curve"]:
        text += speed_curve.curve_text(tables["speed_curve"], cpu_backend)
        text += speed_nvcloth.nvcloth_text(tables["speed_curve"], tables["speed_nvcloth"])
    if tables["speed_peers"]:
        text += speed_curve.peers_text(tables["speed_peers"])
    if tables["speed_service"]:
        text += speed_service.service_text(tables["speed_service"])
    if tables["speed_kernels"]:
        text += speed_kernels.kernels_text(tables["speed_kernels"], gl_device)
    if tables["speed_local_sizes"]:
        text += speed_local_sizes.local_sizes_text(tables["speed_local_sizes"], gl_device)
    if tables["speed_packing"]:
        text += speed_local_sizes.packing_text(tables["speed_packing"])
    return ["## Speed\n", *text] if text else []
