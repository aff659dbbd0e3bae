// Figure 4: 65 536 particles swing onto a sphere; their stretch, and the cost of a step.
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/step_rows.h"
#include "tests/bench/subcommands.h"
#include "tests/support/states.h"

namespace drape::bench {
namespace {

struct Motion {
  bool is_complete = false;      // false: the budget was used up
  test::Scene at_most_contacts;  // the scene where it had most of them
  uint32_t most_contacts = 0;
  double max_strain = 0;
};

// Plays the scene once and writes what it does over time, a row every 6 steps.
Motion Play(Bench& bench, Table& table, const std::string& preset, const test::Scene& scene,
            double duration_s) {
  constexpr uint32_t kStepsPerRow = 6;
  NamedBackend& named = bench.fast_backend();
  Motion motion{.is_complete = true, .at_most_contacts = scene};
  const double time_step_s = scene.parameters.settings.time_step_s;
  const auto rows = static_cast<uint32_t>(std::lround(duration_s / time_step_s / kStepsPerRow));
  const ClothHandle cloth = test::CreateCloth(*named.backend, scene);
  for (uint32_t row = 1; row <= rows && motion.is_complete; ++row) {
    const double time_s = time_step_s * kStepsPerRow * row;
    motion.is_complete = bench.StartRow(scene.name + ", " + preset + ", " + named.name +
                                        ", t = " + Cell(time_s).text() + " s");
    if (!motion.is_complete) break;
    const StepReport report = test::StepAlone(*named.backend, cloth, scene, kStepsPerRow, true);
    const Measurements& m = report.measured;
    table.Add({preset, scene.model->particle_count(), named.name, time_s, m.contacts, m.max_strain,
               m.rms_strain, m.kinetic_energy_j, m.lowest_m, m.max_penetration_m, report.iterations,
               FaultReasonText(report.fault).data()});
    motion.max_strain = std::max(motion.max_strain, m.max_strain);
    if (m.contacts > motion.most_contacts) {
      motion.most_contacts = m.contacts;
      motion.at_most_contacts.state = test::ReadState(*named.backend, cloth);
    }
  }
  named.backend->Destroy(cloth);
  return motion;
}

}  // namespace

void MeasureFigure4(Bench& bench, Figure4Options options) {
  if (bench.is_quick()) options = {.side = 16, .duration_s = 0.6, .presets = {"REALTIME"}};
  Table motion_table =
      bench.OpenTable("figure_4_motion", {"preset", "particles", "backend", "time_s", "contacts",
                                          "max_strain", "rms_strain", "kinetic_energy_j",
                                          "lowest_m", "max_penetration_m", "iterations", "fault"});
  Table table = bench.OpenTable("figure_4", StepColumns());
  for (const std::string& preset : options.presets) {
    const test::Scene scene = Figure4(options.side, SettingsOf(preset));
    const Motion motion = Play(bench, motion_table, preset, scene, options.duration_s);
    if (!motion.is_complete) return;
    const StepRow row{.preset = preset,
                      .pins = "corners",
                      .cloths = 1,
                      .particles = scene.model->particle_count(),
                      .swing_max_strain = motion.max_strain};
    // Straight gravity: the scene as it stands.
    const ClothBatch batch{motion.at_most_contacts, {scene.parameters.gravity_m_per_s2}};
    if (!MeasureRow(bench, table, row, batch)) return;
  }
}

}  // namespace drape::bench
