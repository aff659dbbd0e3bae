#include "server/solver/gl_compute/kernel_costs.h"

#include <algorithm>

#include "server/core/check.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint64_t RoundsFor(uint64_t elements, uint64_t local_size) {
  return (elements + local_size - 1) / local_size;
}

// What a loop costs beside its rounds. Its condition is tested once more than its body is run, and
// llvmpipe was seen to book up to one more (a chain of one link: 6 passes a sweep where counting by
// hand gives 5).
constexpr uint64_t kLoopEnd = 2;

uint64_t LoopPasses(uint64_t elements, uint64_t local_size) {
  return RoundsFor(elements, local_size) + kLoopEnd;
}

// Most entries of one particle in a list that has those of particle p from offsets[p] to
// offsets[p + 1].
uint64_t LargestDegree(std::span<const uint32_t> offsets) {
  uint64_t largest = 0;
  for (size_t i = 0; i + 1 < offsets.size(); ++i) {
    largest = std::max<uint64_t>(largest, offsets[i + 1] - offsets[i]);
  }
  return largest;
}

uint64_t LargestSpringDegree(const SceneModel& model) {
  return model.spring_count() == 0 ? 0 : LargestDegree(model.spring_offsets());
}

// Invocations run in vectors, so each round takes as long as its particle with the most springs.
uint64_t SpringPasses(const SceneModel& model, uint64_t rounds) {
  return kLoopEnd * rounds +
         std::min<uint64_t>(rounds * LargestSpringDegree(model), 2 * model.spring_count());
}

// Of one kick of the air.
uint64_t AirPasses(const SceneModel& model, uint64_t rounds, uint32_t local_size) {
  const uint64_t triangles = model.triangles().size();
  const uint64_t of_particles = rounds * LargestDegree(model.triangle_offsets());
  return LoopPasses(triangles, local_size) + (1 + kLoopEnd) * rounds + kLoopEnd +
         std::min<uint64_t>(of_particles, 3 * triangles);
}

}  // namespace

LoopCosts CountResidentLoops(const SceneModel& model, const ClothParameters& parameters,
                             uint32_t local_size) {
  const uint64_t rounds = RoundsFor(model.particle_count(), local_size);
  const uint64_t particles = rounds + kLoopEnd;
  const uint64_t colliders = parameters.colliders.size();
  const bool has_springs = model.spring_count() > 0;
  const uint64_t springs = has_springs ? 2 * particles + SpringPasses(model, rounds) : 0;

  const uint64_t air = HasAirForces(model, parameters) ? AirPasses(model, rounds, local_size) : 0;

  LoopCosts costs;
  costs.sweep = 1 + model.colour_count() + kLoopEnd;
  const std::span<const uint32_t> offsets = model.colour_offsets();
  for (uint32_t c = 0; c < model.colour_count(); ++c) {
    costs.sweep += LoopPasses(offsets[c + 1] - offsets[c], local_size);
  }
  if (colliders > 0) costs.sweep += particles + rounds * (colliders + kLoopEnd);
  costs.substep =
      1 + kLoopEnd + springs + air + 2 * particles + 2 * LoopPasses(model.pin_count(), local_size);
  if (HasTethers(model, parameters.settings)) {
    costs.substep += particles + rounds * (kMaxTethersPerParticle + kLoopEnd);
  }
  if (colliders > 0) costs.substep += 2 * rounds * (colliders + kLoopEnd);
  // Loading, checking with its loop over the axes, storing, pausing.
  costs.fixed = springs + air + 4 * particles + 4 * rounds + 8;
  return costs;
}

bool CanRunInParts(const LoopCosts& costs, uint64_t budget) {
  return costs.fixed + 3 * (costs.substep + costs.sweep) <= budget;
}

uint64_t CountParts(const LoopCosts& costs, const StepSettings& settings, uint64_t budget) {
  DRAPE_CHECK(CanRunInParts(costs, budget), "the budget of a dispatch is too small for this cloth");
  const uint64_t total =
      settings.substeps * (costs.substep + settings.max_iterations * costs.sweep);
  if (costs.fixed + total <= budget) return 1;
  // A part leaves less than a substep and a sweep unused, and books the substep it goes on with
  // again.
  const uint64_t useful = budget - costs.fixed - 2 * (costs.substep + costs.sweep);
  return RoundsFor(total, useful);
}

uint64_t CountLongestLoop(const SceneModel& model, const ClothParameters& parameters,
                          uint32_t local_size) {
  const uint64_t colliders = parameters.colliders.size();
  const uint64_t piece_rounds = RoundsFor(DRAPE_MEASURE_PIECE, local_size);
  const uint64_t measure = 2 * (piece_rounds + 1) + piece_rounds * (colliders + 1) +
                           SpringPasses(model, piece_rounds) + 16;
  const uint64_t air =
      HasAirForces(model, parameters) ? LargestDegree(model.triangle_offsets()) + 1 : 0;
  const uint64_t tiled = std::max({LargestSpringDegree(model) + 1, air, 2 * (colliders + 1),
                                   uint64_t{kMaxTethersPerParticle} + 1});
  // `tiled_begin_sweeps` and `tiled_end_sweep` go through the dispatches of all colours.
  const uint64_t control = LoopPasses(model.colour_count() + 2, local_size);
  return std::max({measure, tiled, control});
}

}  // namespace drape
