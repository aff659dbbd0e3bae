// Section 3.3: does the order of the colours change how fast the sweeps converge?
#include <cstdio>
#include <string>
#include <utility>

#include "tests/bench/orders.h"
#include "tests/bench/subcommands.h"
#include "tests/bench/sweeps.h"

namespace drape::bench {
namespace {

constexpr uint32_t kSweepsOfPaper = 100;
constexpr uint32_t kMaxSweeps = 3000;

struct MeasuredScene {
  std::string name;
  test::Scene scene;
};

// Steps with many sweeps before the orders are compared. The two corners stand closer than the row
// between them is long: taut, it would be locked, and no order solves that.
std::vector<MeasuredScene> Scenes(bool is_quick) {
  StepSettings settings = PresetSettings(Preset::kPaper);
  settings.max_iterations = kMaxSweeps;
  const uint32_t side = is_quick ? 8 : 32;
  test::Scene slack = Sheet(side * side, Pins::kCorners, settings);
  slack.pin_targets_m = {{0.05, 0, 0}, {0.95, 0, 0}};
  return {{"hanging_edge", Sheet(side * side, Pins::kEdge, settings)},
          {"two_corners", std::move(slack)},
          {"mesh_skirt", Skirt(2 * side, side / 2, settings)}};
}

// One substep from one moment of a scene: every order solves the same problem.
class Moment {
 public:
  Moment(Table& table, const MeasuredScene& measured, double time_s, double substep_s)
      : table_(table), measured_(measured), time_s_(time_s) {
    const test::Scene& scene = measured.scene;
    problem_ =
        PredictSubstep(*scene.model, scene.state, scene.parameters.gravity_m_per_s2, substep_s);
  }

  uint32_t Measure(const char* shuffled, uint32_t seed, const ConstraintOrder& order) {
    const SceneModel& model = *measured_.scene.model;
    const uint32_t sweeps = SweepsUntil(problem_, order.constraints,
                                        measured_.scene.parameters.settings.tolerance, kMaxSweeps);
    const RelativeError error = ErrorAfter(problem_, order.constraints, kSweepsOfPaper);
    table_.Add({measured_.name, model.particle_count(), model.constraint_count(), time_s_,
                problem_.substep_s, shuffled, seed, order.colours, sweeps, error.max, error.rms});
    return sweeps;
  }

  void MeasureAll(uint32_t seeds) {
    const SceneModel& model = *measured_.scene.model;
    const uint32_t baseline = Measure("nothing", 0, ModelOrder(model));
    const uint32_t from = Measure("from_pins", 0, FromPins(model));
    const uint32_t towards = Measure("towards_pins", 0, TowardsPins(model));
    std::printf("    h = %.5f s: Algorithm 1: %u sweeps; from the pins: %u; towards them: %u\n",
                problem_.substep_s, baseline, from, towards);
    for (uint32_t seed = 1; seed <= seeds; ++seed) {
      std::mt19937 random(seed);
      Measure("colours", seed, ShuffleColours(model, random));
      Measure("input", seed, ShuffleInput(model, random));
      Measure("all", seed, ShuffleAll(model, random));
    }
  }

 private:
  Table& table_;
  const MeasuredScene& measured_;
  double time_s_;
  SweepProblem problem_;
};

}  // namespace

void MeasureOrder(Bench& bench, OrderOptions options) {
  if (bench.is_quick()) options.seeds = 2;
  Table table = bench.OpenTable(
      "order", {"scene", "particles", "constraints", "time_s", "substep_s", "shuffled", "seed",
                "colours", "sweeps", "max_error_after_100", "rms_error_after_100"});
  const std::vector<uint32_t> at_steps =
      bench.is_quick() ? std::vector<uint32_t>{6} : std::vector<uint32_t>{6, 18, 36, 60};
  for (MeasuredScene& measured : Scenes(bench.is_quick())) {
    uint32_t step = 0;
    for (const uint32_t at_step : at_steps) {
      const double time_s = at_step * measured.scene.parameters.settings.time_step_s;
      if (!bench.StartRow(measured.name + ", t = " + Cell(time_s).text() + " s, " +
                          std::to_string(options.seeds) + " seeds")) {
        return;
      }
      measured.scene =
          Advance(*bench.reference().backend, std::move(measured.scene), at_step - step).scene;
      step = at_step;
      const double step_s = measured.scene.parameters.settings.time_step_s;
      for (const double substep_s : {step_s, step_s / 4}) {
        Moment(table, measured, time_s, substep_s).MeasureAll(options.seeds);
      }
    }
  }
}

}  // namespace drape::bench
