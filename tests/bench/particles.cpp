// Figure 3b: ms per step of one cloth against its particles.
#include <string>

#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {

void MeasureParticles(Bench& bench, ParticlesOptions options) {
  if (bench.is_quick()) options = {{64, 128}, {"PAPER"}};
  Table table = bench.OpenTable("particles", StepColumns());
  for (const Pins pins : {Pins::kCorners, Pins::kEdge}) {
    for (const std::string& preset : options.presets) {
      for (const uint32_t particles : options.particles) {
        const PreparedScene start = MidSwing(bench, particles, pins, preset);
        const StepRow row{.preset = preset,
                          .pins = PinsName(pins),
                          .cloths = 1,
                          .particles = particles,
                          .swing_max_strain = start.max_strain};
        if (!MeasureRow(bench, table, row, MakeBatch(start.scene, 1))) return;
      }
    }
  }
}

}  // namespace drape::bench
