#include "server/scheduler/sleep_looks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/core/trace.h"
#include "server/scheduler/state_reading.h"

namespace drape {
namespace {

// Limit on the particles read at once: 12 MiB in single precision.
constexpr size_t kMaxParticlesPerLook = size_t{1} << 20;

void Look(Backend& backend, std::span<const std::shared_ptr<ClothRuntime>> cloths) {
  const trace::Span span("look");
  const ClothSpan looked_at(cloths);
  SharedRead read(backend, {&looked_at, 1}, {true, false}, RowsAre::kParticles);
  const StateColumns state = std::move(read.Take()[0]);
  size_t first_row = 0;
  for (const auto& cloth : cloths) {
    cloth->sleep().Look(state.positions_m, first_row, cloth->particle_count());
    first_row += cloth->particle_count();
  }
}

}  // namespace

void LookAtCloths(Backend& backend, std::span<const std::shared_ptr<ClothRuntime>> cloths) {
  std::vector<std::shared_ptr<ClothRuntime>> wanting;
  size_t particles = 0;
  for (const auto& cloth : cloths) {
    if (!cloth->sleep().wants_look()) continue;
    wanting.push_back(cloth);
    particles += cloth->particle_count();
    if (particles < kMaxParticlesPerLook) continue;
    Look(backend, wanting);
    wanting.clear();
    particles = 0;
  }
  if (!wanting.empty()) Look(backend, wanting);
  std::vector<ClothWorld*> worlds;  // once each, not once for each cloth in them
  for (const auto& cloth : cloths) {
    ClothWorld* const world = cloth->world().get();
    if (world != nullptr && (worlds.empty() || worlds.back() != world)) worlds.push_back(world);
  }
  std::ranges::sort(worlds);
  worlds.erase(std::ranges::unique(worlds).begin(), worlds.end());
  for (ClothWorld* const world : worlds) world->LevelWatches();
}

}  // namespace drape
