#include "tests/bench/accuracy/quantities.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <limits>
#include <map>
#include <stdexcept>
#include <utility>

#include "tests/bench/accuracy/contestant.h"
#include "tests/bench/accuracy/fabric_scenes.h"
#include "tests/bench/accuracy/resting_scenes.h"

namespace drape::bench {
namespace {

const std::vector<std::string> kQuantityColumns = {
    "kind",     "scene", "particles", "time_step_s", "backend", "method",
    "quantity", "unit",  "value",     "expected",    "error",   "relative_error"};

std::vector<QuantityKind> ChosenKinds(const std::vector<std::string>& names) {
  if (names.empty()) return QuantityKinds();
  std::vector<QuantityKind> chosen;
  for (const std::string& name : names) {
    const auto is_it = [&](const QuantityKind& kind) { return kind.name == name; };
    const auto found = std::find_if(QuantityKinds().begin(), QuantityKinds().end(), is_it);
    if (found == QuantityKinds().end()) {
      std::string legal;
      for (const QuantityKind& kind : QuantityKinds()) legal += " " + kind.name;
      throw std::runtime_error("--quantities: '" + name + "' is none of" + legal);
    }
    chosen.push_back(*found);
  }
  return chosen;
}

// The states after the last frames; none if the cloth is faulted.
std::vector<ParticleState> LastStates(Backend& backend, const QuantityScene& scene,
                                      StepSettings settings) {
  settings.time_step_s = scene.time_step_s;
  const auto contestant = MakeContestant(backend, scene.scene, settings);
  const auto frames = static_cast<uint32_t>(std::lround(scene.duration_s / scene.time_step_s));
  std::vector<ParticleState> last;
  for (uint32_t frame = 1; frame <= frames; ++frame) {
    if (contestant->Step().is_faulted) return {};
    if (frame + scene.last_states > frames) last.push_back(contestant->State());
  }
  return last;
}

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

// The values in the first scene of a kind that has them, by method and quantity.
using FirstValues = std::map<std::pair<std::string, std::string>, double>;

double ExpectedValue(const Quantity& quantity, const std::string& method, double value,
                     FirstValues& first) {
  if (quantity.expected) return *quantity.expected;
  const auto [found, is_first] = first.try_emplace({method, quantity.name}, value);
  return is_first ? kNotKnown : found->second;
}

void AddRow(Table& table, const std::string& kind, const QuantityScene& scene,
            const std::string& backend, const std::string& method, const Quantity& quantity,
            double value, FirstValues& first) {
  const double expected = ExpectedValue(quantity, method, value, first);
  const double error = value - expected;
  const double relative_error = expected == 0 ? kNotKnown : error / std::abs(expected);
  table.Add({kind, scene.name, scene.scene.model->particle_count(), scene.time_step_s, backend,
             method, quantity.name, quantity.unit, value, expected, error, relative_error});
  std::printf("    %-9s %-32s %12.5g %s, expected %.5g\n", method.c_str(), quantity.name.c_str(),
              value, quantity.unit.c_str(), expected);
  std::fflush(stdout);
}

}  // namespace

const std::vector<QuantityKind>& QuantityKinds() {
  static const std::vector<QuantityKind> kinds = {
      {"rest", "second difference of positions over frames, damped for 12 s", RestScenes},
      {"slope", "friction 2 % above or below a slope of 0.5 rad", SlopeScenes},
      {"capstan", "chains over bars, 2 % below what static friction holds", CapstanScenes},
      {"caught", "balls that fall onto a sheet held by its corners", CatchScenes},
      {"cantilever", "drop of a clamped strip against the elastica", CantileverScenes},
      {"garment", "strains of garments that hang, made by rule", GarmentScenes},
      {"drape", "drape coefficient of a square on a round table", DrapeScenes},
      {"sag_by_side", "cotton hung by two corners, at four resolutions", SagScenesBySide},
      {"sag_by_step", "cotton hung by two corners, at four time steps", SagScenesByStep}};
  return kinds;
}

void MeasureQuantities(Bench& bench, const std::vector<std::string>& names) {
  const std::vector<QuantityKind> kinds = ChosenKinds(names);
  Table table = bench.OpenTable("accuracy_quantities", kQuantityColumns);
  NamedBackend& named = bench.backends()[0];
  for (const QuantityKind& kind : kinds) {
    FirstValues first;
    for (const QuantityScene& scene : kind.scenes(bench.is_quick())) {
      if (!bench.StartRow(kind.name + ", " + scene.name + ": " + kind.title)) return;
      for (const Method& method : MethodsFor(scene.scene, PointGrid::kPresets)) {
        if (scene.is_slow && method.name != "REALTIME") continue;
        const std::vector<ParticleState> last = LastStates(*named.backend, scene, method.settings);
        for (const Quantity& quantity : scene.quantities) {
          const double value = last.empty() ? kNotKnown : quantity.of(last);
          AddRow(table, kind.name, scene, named.name, method.name, quantity, value, first);
        }
      }
    }
  }
}

}  // namespace drape::bench
